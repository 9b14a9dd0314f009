//! Acceptance tests: identities, conservation, analytic, reference, determinism, tidy.
