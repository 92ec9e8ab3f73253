//! The tests, by what goes wrong.

mod change;
mod energy;
mod gloss;
mod laws;
mod motion;
mod network;
mod rest;
mod robust;
mod view;

use super::{StabilityError, Test};

/// Size of most tests' pictures: cells of 4×4 pixels, and seconds on a CPU.
const SMALL: [u32; 2] = [96, 64];

/// Size of tests whose surfaces have to hold many cells.
const LARGE: [u32; 2] = [256, 128];

/// Frames after which a method's history is long enough to show what it does.
const LONG: usize = 40;

/// All tests, in the order in which they run.
pub fn all() -> Vec<&'static Test> {
    let groups: [&[&'static Test]; 9] = [
        &[&rest::FROZEN, &rest::DARK_ROOM, &rest::REPEAT],
        &[
            &motion::JITTER,
            &motion::SLOW_PAN,
            &motion::FAST_PAN,
            &motion::DOORWAY,
            &motion::TELEPORT,
            &motion::DISOCCLUSION,
        ],
        &[&change::SWITCH, &change::SWEEP, &change::DOOR],
        &[&view::RED_WALL, &view::CROP, &view::TWO_PLACES],
        &[&laws::TWICE, &laws::SUM, &laws::EXPOSURE, &laws::SATURATED, &laws::UNITS],
        &[&energy::ALBEDO, &energy::FURNACE, &energy::SEALED, &energy::THIN_WALL, &energy::CORNER],
        &[&gloss::METAL, &gloss::MIRROR],
        &[&robust::SIZES, &robust::BROKEN],
        &[&network::FLAT, &network::HALF, &network::UNSEEN],
    ];
    groups.concat()
}

/// The tests of a list of names between commas, or `all`.
///
/// # Errors
/// [`StabilityError::NoTest`].
pub fn named(list: &str) -> Result<Vec<&'static Test>, StabilityError> {
    if list == "all" {
        return Ok(all());
    }
    let find = |name: &str| {
        let found = all().into_iter().find(|t| t.name == name);
        let known = || all().iter().map(|t| t.name).collect::<Vec<_>>().join(", ");
        found.ok_or_else(|| StabilityError::NoTest { name: name.into(), known: known() })
    };
    list.split(',').map(|name| find(name.trim())).collect()
}

#[cfg(test)]
mod unit {
    use super::*;

    #[test]
    fn names_are_different_and_found() {
        let names: Vec<&str> = all().iter().map(|t| t.name).collect();
        let mut sorted = names.clone();
        sorted.sort_unstable();
        sorted.dedup();
        assert_eq!(sorted.len(), names.len());
        assert!(all().iter().all(|t| !t.limits.is_empty() && t.question.ends_with('?')));
        let two = named("crop, switch").expect("they are there");
        assert_eq!(two.iter().map(|t| t.name).collect::<Vec<_>>(), ["crop", "switch"]);
        let error = named("crop,nonsense").err().expect("there is none").to_string();
        assert!(error.contains("`nonsense`") && error.contains("two-places"), "{error}");
    }
}
