//! Sinew tests.
