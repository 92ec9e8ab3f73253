//! What a run of the tests has found, as JSON holds it.

use super::{Test, Unit};
use crate::study::device::Device;
use serde::{Deserialize, Deserializer, Serialize};

/// Version of the record's form.
pub const SCHEMA: u32 = 1;

/// A whole run.
#[derive(Debug, Clone, Serialize)]
pub struct Record {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Version of the program.
    pub version: String,
    /// What drew.
    #[serde(flatten)]
    pub device: Device,
    /// Who was tested.
    pub subjects: Vec<SubjectRecord>,
    /// One entry a test.
    pub tests: Vec<Finding>,
}

/// Who was tested.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SubjectRecord {
    /// Name in tables.
    pub name: String,
    /// Hash of its weights.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weights: Option<String>,
}

/// What one test has found.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Finding {
    /// Its name.
    pub name: String,
    /// What can go wrong.
    pub question: String,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Paths a pixel of the truth.
    pub paths: u32,
    /// With what the truth was spoilt for the control.
    pub control: String,
    /// What is measured.
    pub criteria: Vec<Criterion>,
    /// The truth passes and its spoilt copy does not: the test measures what it says.
    pub sound: bool,
    /// Why the truth could not be had, if it could not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unsound: Option<String>,
    /// One entry a subject.
    pub found: Vec<Found>,
}

/// A number with its threshold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Criterion {
    /// What is measured.
    pub name: String,
    /// In which unit.
    pub unit: Unit,
    /// The largest value that passes.
    pub at_most: f64,
    /// Where that comes from.
    pub source: String,
    /// The path tracer's own value, its noise included; absent where it could not be had.
    pub truth: Option<f64>,
    /// That of the spoilt truth.
    pub control: Option<f64>,
}

/// One subject's answer.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Found {
    /// Its name.
    pub subject: String,
    /// Values in the order of the criteria; not finite ones are null, and fail. Empty where the
    /// test has no meaning for it.
    #[serde(deserialize_with = "values")]
    pub values: Vec<f64>,
    /// Every value is within its limit; absent where the test has no meaning for it.
    pub pass: Option<bool>,
    /// Seconds that drawing and measuring took.
    pub seconds: f64,
    /// Why there are no values.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Another method drew in its place, and why.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fallback: Option<String>,
    /// Why it fails, where that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
}

impl Finding {
    /// A test before it is run.
    pub(super) fn new(test: &Test) -> Self {
        let criterion = |limit: &super::Limit| Criterion {
            name: limit.name.into(),
            unit: limit.unit,
            at_most: limit.at_most,
            source: limit.source.into(),
            truth: None,
            control: None,
        };
        Self {
            name: test.name.into(),
            question: test.question.into(),
            size: test.size,
            paths: test.paths,
            control: test.control.words(),
            criteria: test.limits.iter().map(criterion).collect(),
            sound: false,
            unsound: None,
            found: Vec::new(),
        }
    }

    /// The criterion that `found` is worst in: its number among the criteria.
    pub fn worst(&self, found: &Found) -> Option<usize> {
        let over = |i: usize| {
            let (value, at_most) = (found.values[i], self.criteria[i].at_most);
            match value {
                v if !v.is_finite() => f64::INFINITY,
                0.0 => 0.0,
                v => v / at_most.max(1e-12),
            }
        };
        (0..found.values.len()).max_by(|a, b| over(*a).total_cmp(&over(*b)))
    }

    /// Value and verdict of the worst criterion in a few words: `0.3 %`, `**12 %**` where it fails,
    /// `–` where there is none.
    pub fn cell(&self, found: &Found) -> String {
        let Some(worst) = self.worst(found) else {
            return if found.pass == Some(false) { "**no answer**".into() } else { "–".into() };
        };
        let text = self.criteria[worst].unit.text(found.values[worst]);
        if found.pass == Some(true) { text } else { format!("**{text}**") }
    }
}

impl Record {
    /// Tests that the subject fails, in order.
    pub fn failures(&self, subject: &str) -> Vec<&str> {
        let fails = |f: &&Finding| f.found.iter().any(|s| s.subject == subject && s.pass == Some(false));
        self.tests.iter().filter(fails).map(|f| f.name.as_str()).collect()
    }
}

/// Whether every value is within its limit.
pub(super) fn passes(test: &Test, values: &[f64]) -> bool {
    values.len() == test.limits.len() && values.iter().zip(test.limits).all(|(v, l)| *v <= l.at_most)
}

/// JSON has no infinity, and writes null.
fn values<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
    let values = Vec::<Option<f64>>::deserialize(from)?;
    Ok(values.into_iter().map(|v| v.unwrap_or(f64::INFINITY)).collect())
}

/// A finding with what it depends on, as it is kept for a later run.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Kept {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Version of the program.
    pub version: String,
    /// Adapter and driver.
    pub device: String,
    /// Who was tested.
    pub subjects: Vec<SubjectRecord>,
    /// What was found.
    pub finding: Finding,
}

impl Kept {
    /// Whether `other`, whose finding is that of a test that has not been run yet, would find the
    /// same again.
    pub fn is_of(&self, other: &Self) -> bool {
        let plain = |f: &Finding| {
            let limits = f.criteria.iter().map(|c| Criterion { truth: None, control: None, ..c.clone() });
            (f.name.clone(), f.size, f.paths, f.control.clone(), limits.collect::<Vec<_>>())
        };
        let key = |k: &Self| (k.schema, k.version.clone(), k.device.clone(), plain(&k.finding));
        key(self) == key(other) && self.subjects == other.subjects
    }
}

#[cfg(test)]
mod unit {
    use super::super::{all, page};
    use super::*;

    fn found(subject: &str, values: Vec<f64>, test: &Test) -> Found {
        let pass = Some(passes(test, &values));
        Found { subject: subject.into(), values, pass, seconds: 1.0, ..Found::default() }
    }

    #[test]
    fn the_worst_number_is_shown_and_infinity_survives_json() {
        let test = all().into_iter().find(|t| t.name == "switch").expect("it is there");
        let mut finding = Finding::new(test);
        finding.found = vec![
            found("good", vec![3.0, 0.001, 2.0, 0.04], test),
            found("late", vec![f64::INFINITY, 0.5, 2.0, 0.04], test),
            found("short", vec![1.0], test),
        ];
        let passed: Vec<_> = finding.found.iter().map(|f| f.pass).collect();
        assert_eq!(passed, [Some(true), Some(false), Some(false)]);
        assert_eq!(
            (finding.cell(&finding.found[0]), finding.cell(&finding.found[1])),
            ("4.00 %".into(), "**none**".into())
        );
        let kept = Kept {
            schema: SCHEMA,
            version: "0".into(),
            device: "d".into(),
            subjects: vec![SubjectRecord { name: "late".into(), weights: None }],
            finding,
        };
        let text = serde_json::to_string(&kept).expect("plain data");
        let back: Kept = serde_json::from_str(&text).expect("the same data");
        assert!(back.is_of(&kept) && back.finding.found[1].values[0].is_infinite());
        let fresh = |name: &str, device: &str| Kept {
            finding: Finding::new(all().into_iter().find(|t| t.name == name).expect("it is there")),
            device: device.into(),
            version: "0".into(),
            schema: SCHEMA,
            subjects: vec![SubjectRecord { name: "late".into(), weights: None }],
        };
        // What was found does not count, all that it depends on does.
        assert!(back.is_of(&fresh("switch", "d")));
        assert!(!back.is_of(&fresh("sweep", "d")) && !back.is_of(&fresh("switch", "e")));
    }

    #[test]
    fn a_page_has_a_sentence_on_every_failure() {
        let test = all().into_iter().find(|t| t.name == "sealed").expect("it is there");
        let mut finding = Finding::new(test);
        finding.found = vec![found("gather", vec![0.0], test), found("odd", vec![0.7], test)];
        let subject = |name: &str| SubjectRecord { name: name.into(), weights: None };
        let record = Record {
            schema: SCHEMA,
            version: "0".into(),
            device: Device { adapter: "a".into(), backend: "b".into(), driver: "d".into(), software: true },
            subjects: vec![subject("gather"), subject("odd")],
            tests: vec![finding],
        };
        assert_eq!((record.failures("odd"), record.failures("gather")), (vec!["sealed"], vec![]));
        let text = page(&record, "the command");
        assert!(text.contains("| sealed | 0.00 % | **70 %** |"), "{text}");
        assert!(text.contains("- **sealed**, `odd`: not explained yet") && text.contains("the command"), "{text}");
        assert!(text.contains("| *passed* | 1 of 1 | 0 of 1 |"), "{text}");
        // The truth was not asked here, so the test proves nothing, which is said.
        assert!(text.contains("say nothing: sealed"), "{text}");
    }
}
