//! Sinew server.
