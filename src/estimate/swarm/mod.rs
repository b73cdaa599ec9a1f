//! Beetle swarm optimisation and its kin.
