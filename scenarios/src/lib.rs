//! Colluvium.
