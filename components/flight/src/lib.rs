//! Component library: flight.
