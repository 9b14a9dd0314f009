//! The Rerun scene, stream and blueprint.
