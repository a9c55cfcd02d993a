//! What the makers of foreign effects are written with.

pub(super) use std::f64::consts::{PI, TAU};

pub(super) use super::act::Change;
pub(super) use super::known::*;
pub(super) use super::shape::*;
pub(super) use super::words::*;
pub(super) use crate::random::Draw;
pub(super) use crate::series::*;
pub(super) use crate::stand::{LSB, Stand};
pub(super) use crate::strength::Meter;
