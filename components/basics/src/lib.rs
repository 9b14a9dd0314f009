//! Component library: basics.
