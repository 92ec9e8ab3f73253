//! Why who fails what: a sentence for each failure whose cause is known, from measurement or from
//! how the method works. A failure without one is shown as not explained.

/// Tests of light that has to be there: who adds none fails them.
const NEEDS_LIGHT: [&str; 9] = ["switch", "sweep", "door", "albedo", "furnace", "corner", "metal", "mirror", "unseen"];

/// Tests in which the picture changes and the light must not.
const NEEDS_MORE_THAN_THE_PICTURE: [&str; 9] =
    ["red-wall", "crop", "two-places", "doorway", "disocclusion", "jitter", "slow-pan", "fast-pan", "broken-input"];

/// The sentence for a test and a subject, where there is one.
pub fn why(test: &str, subject: &str) -> Option<&'static str> {
    Some(match (test, subject) {
        (test, "direct") if NEEDS_LIGHT.contains(&test) => {
            "it adds no light, so what the sky, bounces and reflections give is missing whole"
        }
        ("sealed", "ambient" | "ssgi") => {
            "nothing on the screen says that there is a roof: where nothing near is in the way they take the sky to be"
        }
        (test, "ambient") if NEEDS_MORE_THAN_THE_PICTURE.contains(&test) => {
            "its light is the sky's and the mean of what the picture shows, so it changes with the picture"
        }
        (test, "ssgi") if NEEDS_MORE_THAN_THE_PICTURE.contains(&test) => {
            "it finds light in the picture and the rest is a mean of it: what has left the picture lights nothing any \
             more"
        }
        ("door" | "corner" | "teleport", "ambient" | "ssgi") => {
            "the light comes from a room that the picture does not show, and they know nothing else"
        }
        ("furnace" | "albedo" | "unseen", "ambient" | "ssgi") => {
            "its bounces are one mean with a fitted constant, which fits rooms like the paper's and no other"
        }
        ("metal" | "mirror", "ambient" | "ssgi") => {
            "its reflections are what the screen shows along the mirrored ray; the red wall behind the camera is not \
             there"
        }
        ("mirror", "gather" | "neural") => {
            "rays into lobes are one a cell of 4×4 pixels and blurred over cells; only what is on the screen is \
             sharp, and the mirrored \
             wall is not"
        }
        ("disocclusion", "gather" | "neural") => {
            "what an object uncovers has eight rays a cell in its first frame, averaged over 5×5 cells: their noise. \
             More rays of entries there (8, 16, 32) change nothing"
        }
        ("crop" | "red-wall", "generator") => {
            "it paints the picture from the picture: what is outside it, and how large things are in it, change the \
             answer"
        }
        ("metal" | "mirror", "generator") => {
            "its pictures say neither how rough a surface is nor what is behind the camera: it paints metal as plaster"
        }
        ("unseen", "generator") => "it has learnt rooms of the paper's kind, and paints their light and colours",
        ("frozen", "generator") => "dropout is on: each frame draws another half of the channels",
        ("flat", "generator") => {
            "a network of seven halvings paints what it has learnt from clutter onto an even floor"
        }
        _ => return None,
    })
}

#[cfg(test)]
mod unit {
    use super::super::all;
    use super::*;

    #[test]
    fn sentences_are_about_tests_that_there_are() {
        let names: Vec<&str> = all().iter().map(|t| t.name).collect();
        assert!(NEEDS_LIGHT.iter().chain(&NEEDS_MORE_THAN_THE_PICTURE).all(|n| names.contains(n)));
        assert!(why("sealed", "ambient").is_some() && why("sealed", "gather").is_none());
    }
}
