//! Spatial algebra: motion, force, phi, rotation, rigid and articulated inertia.
