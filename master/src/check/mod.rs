//! From a description and the models of its FMUs to a validated [`plan::Plan`], or every fault at once.

pub mod order;
pub mod plan;
