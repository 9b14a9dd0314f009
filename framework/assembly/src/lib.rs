//! RON assemblies and the Rust builder: one intermediate form, all diagnostics at once.
