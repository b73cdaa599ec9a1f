//! The truth maker.
