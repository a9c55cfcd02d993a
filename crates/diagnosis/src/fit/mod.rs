//! The likelihood of a channel, its terms, and what a term has to reach.

pub mod bins;
pub mod channel;
pub mod estimate;
pub mod likelihood;
pub mod prequential;
pub mod scan;
pub mod score_test;
pub mod threshold;
