//! Component library: mobility.
