//! The ATmega16 in simavr, corrected where simavr is wrong.
