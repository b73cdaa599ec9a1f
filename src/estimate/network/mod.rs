//! The multilayer perceptron.
