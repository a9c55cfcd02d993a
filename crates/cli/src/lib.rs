//! Capture, analysis and diagnosis of an inertial test stand.
