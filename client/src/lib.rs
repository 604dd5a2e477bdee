//! Sinew client.
