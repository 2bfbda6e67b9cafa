//! Nets to C99
