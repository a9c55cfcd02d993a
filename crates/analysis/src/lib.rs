//! Allan family, fits, checks and diagnosis of inertial sensor records.
