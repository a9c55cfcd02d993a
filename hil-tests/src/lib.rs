//! The real image on a simulated ATmega16, or on a real board.
