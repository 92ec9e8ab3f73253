//! Labels of passes in files that outlive a version: records of `bench` and `chart`, measurements of
//! devices, export manifests. Readers take the labels that earlier versions wrote.

use serde::{Deserialize, Deserializer};

/// Labels of earlier versions and what they are called now.
const RENAMED: &[(&str, &str)] = &[
    ("gi.cells", "gi.downsample"),
    ("gi.recall", "gi.reproject"),
    ("gi.rays", "gi.trace"),
    ("gi.settle", "gi.accumulate"),
    ("gi.renew", "gi.cache_update"),
    ("gi.evict", "gi.cache_evict"),
    ("gi.smooth", "gi.atrous"),
    ("gi.bring", "gi.upsample"),
    ("gi.mirror", "gi.specular_trace"),
    ("gi.lit", "gi.color_pyramid"),
    ("gi.glossy", "gi.ssr"),
    // Owners of memory.
    ("moved", "previous_transforms"),
];

/// The label that a pass has now.
pub fn current(label: &str) -> &str {
    RENAMED.iter().find(|(old, _)| *old == label).map_or(label, |(_, new)| new)
}

/// Reads a label, for `#[serde(deserialize_with)]`.
///
/// # Errors
/// The deserializer's, where there is no text.
pub fn read<'de, D: Deserializer<'de>>(from: D) -> Result<String, D::Error> {
    String::deserialize(from).map(|label| current(&label).to_owned())
}

/// Reads rows of a label and bytes.
///
/// # Errors
/// The deserializer's, where there are no such rows.
pub fn read_rows<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<(String, u64)>, D::Error> {
    let rows = Vec::<(String, u64)>::deserialize(from)?;
    Ok(rows.into_iter().map(|(label, bytes)| (current(&label).to_owned(), bytes)).collect())
}

#[cfg(test)]
mod tests {
    use super::current;
    use crate::export::manifest::Dispatch;
    use crate::study::bench::Measurement;

    #[test]
    fn records_of_earlier_versions_are_read_by_the_labels_of_today() {
        let text = r#"{"method": "gather", "gpu_ms": null, "wall_ms": {"median": 1, "p95": 1},
            "passes": [{"pass": "gi.settle", "ms": {"median": 1, "p95": 1}}], "bytes": [["gi.lit", 7], ["scene", 8]],
            "costs": [{"pass": "gi.rays", "flops": 1, "bytes": 1}]}"#;
        let read: Measurement = serde_json::from_str(text).expect("a record");
        assert_eq!((&*read.passes[0].pass, &*read.costs[0].pass), ("gi.accumulate", "gi.trace"));
        assert_eq!(read.bytes, [("gi.color_pyramid".to_owned(), 7), ("scene".to_owned(), 8)]);
        let text = r#"{"label": "gi.bring", "shader": 0, "workgroups": [1, 1, 1], "resources": []}"#;
        assert_eq!(serde_json::from_str::<Dispatch>(text).expect("a dispatch").label, "gi.upsample");
        assert_eq!(current("gi.blur"), "gi.blur");
    }

    #[test]
    fn new_labels_are_passes() {
        let known: Vec<String> = bouncelight::gpu::shaders::names().collect();
        for (old, new) in super::RENAMED {
            // No shaders of their own.
            assert!(["gi.cache_evict", "previous_transforms"].contains(new) || known.iter().any(|n| n == new), "{new}");
            assert!(known.iter().all(|n| n != old), "{old} is a pass again");
        }
    }
}
