//! Linkwork: simulate machines made of parts. Re-exports the floors in reading order.
