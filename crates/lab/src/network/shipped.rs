//! The generators that come with the program, beside the filter of the core. `bouncelight weights
//! info generator` shows where they come from.

use bouncelight::gi::name::MethodName;
use bouncelight::net::format::{Weights, WeightsError};
use std::path::Path;

static GENERATOR: &[u8] = include_bytes!("../../assets/weights/generator.safetensors");
static GENERATOR_GATHER: &[u8] = include_bytes!("../../assets/weights/generator-gather.safetensors");

/// The shipped network of a method that needs one.
///
/// # Errors
/// Never for an unmodified build; files are checked as any other.
pub fn of(method: MethodName) -> Result<Weights, WeightsError> {
    match method {
        MethodName::Generator => Weights::from_bytes(GENERATOR),
        MethodName::GeneratorGather => Weights::from_bytes(GENERATOR_GATHER),
        _ => Weights::shipped(),
    }
}

/// The weights in `path`, or the shipped ones of that name where there is no such file.
///
/// # Errors
/// As [`Weights::load`].
pub fn find(path: &Path) -> Result<Weights, WeightsError> {
    let painters = [MethodName::Generator, MethodName::GeneratorGather];
    match painters.into_iter().find(|m| path.to_str() == Some(m.name()) && !path.exists()) {
        Some(method) => of(method),
        None => Weights::find(Some(path)),
    }
}

/// The method that runs such weights: a filter's, a generator's, or one's that is given the picture with the light of
/// `gather`.
pub fn method_of(weights: &Weights) -> MethodName {
    match weights.table.name == "images" {
        true if weights.inputs.iter().any(|feature| feature.name == "gathered") => MethodName::GeneratorGather,
        true => MethodName::Generator,
        false => MethodName::Neural,
    }
}

/// What `method` runs: the weights in `path` if they are of its kind, else those that come with the program. For many
/// methods at once.
///
/// # Errors
/// As [`Weights::load`].
pub fn fitting(method: MethodName, path: Option<&Path>) -> Result<Weights, WeightsError> {
    match path.map(find).transpose()?.filter(|weights| method_of(weights) == method) {
        Some(weights) => Ok(weights),
        None => of(method),
    }
}
