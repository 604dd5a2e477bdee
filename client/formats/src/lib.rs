//! Sinew formats.
