//! KHR_animation_pointer: channels that name what they move by its place in the file's JSON.

use super::repair::Warning;
use serde_json::{Value, json};

/// The extension's name.
const NAME: &str = "KHR_animation_pointer";

/// Rewrites channels that point to a node's own properties into ordinary ones and takes the others
/// out, which a plain reader would refuse: they have no node. `None` where there is nothing to do;
/// else the new JSON, and place and problem of a warning for each channel that is left out.
pub(super) fn rewrite(json: &[u8]) -> Option<(Vec<u8>, Vec<Warning>)> {
    if !json.windows(NAME.len()).any(|w| w == NAME.as_bytes()) {
        return None;
    }
    let mut root: Value = serde_json::from_slice(json).ok()?;
    let mut warnings = Vec::new();
    for (a, animation) in root.get_mut("animations")?.as_array_mut()?.iter_mut().enumerate() {
        let Some(channels) = animation.get_mut("channels").and_then(Value::as_array_mut) else { continue };
        let mut c = 0;
        channels.retain_mut(|channel| {
            let place = format!("animations[{a}].channels[{c}]");
            c += 1;
            let pointer = channel.pointer(&format!("/target/extensions/{NAME}/pointer"));
            let Some(pointer) = pointer.and_then(Value::as_str).map(str::to_owned) else { return true };
            let words: Vec<&str> = pointer.split('/').collect();
            if let &["", "nodes", node, path @ ("translation" | "rotation" | "scale" | "weights")] = words.as_slice()
                && let Ok(node) = node.parse::<u32>()
            {
                channel["target"] = json!({"node": node, "path": path});
                return true;
            }
            warnings.push((place, format!("moves `{pointer}`, which is not supported, and is left out")));
            false
        });
    }
    serde_json::to_vec(&root).ok().map(|text| (text, warnings))
}
