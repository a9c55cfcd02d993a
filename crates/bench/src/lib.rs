//! The physical stand as a witness: parts, motor, supply, thermal and mechanical world.
