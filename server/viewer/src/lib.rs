//! Sinew viewer.
