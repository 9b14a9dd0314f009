//! RON assemblies that ship with Linkwork, embedded.
