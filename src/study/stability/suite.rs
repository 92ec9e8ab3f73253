//! Runs tests: the truth, the truth spoilt, then everybody else.

use super::{
    Finding, Found, Play, Record, Sheet, StabilityError, Subject, Test, explain,
    play::Stage,
    record::{SCHEMA, SubjectRecord, passes},
    sheet::Row,
};
use crate::gpu::Gpu;
use crate::study::trial::TrialError;
use std::{path::PathBuf, time::Instant};

/// What is run, and how.
pub struct SuiteOptions {
    /// Tests, in order.
    pub tests: Vec<&'static Test>,
    /// Who takes them, in order.
    pub subjects: Vec<Subject>,
    /// Folder of references that were traced before.
    pub kept: Option<PathBuf>,
}

/// What is told while it runs.
pub enum Event<'a> {
    /// A subject has begun a test.
    Begun {
        /// The test.
        test: &'static Test,
        /// Who takes it.
        subject: &'a str,
    },
    /// A test is over.
    Done {
        /// What was found.
        finding: &'a Finding,
        /// Its pictures.
        sheet: &'a Sheet,
    },
}

/// Tests about to be run.
pub struct Suite<'a> {
    gpu: &'a Gpu,
    options: SuiteOptions,
}

impl<'a> Suite<'a> {
    /// On this device.
    pub fn new(gpu: &'a Gpu, options: SuiteOptions) -> Self {
        Self { gpu, options }
    }

    /// Steps of [`Self::run`]: one for each test and subject, the truth and its control among them.
    pub fn steps(&self) -> u64 {
        self.options.tests.len() as u64 * (self.options.subjects.len() as u64 + 2)
    }

    /// Runs all tests. What cannot be drawn is told in the record and loses nobody else's answer. `go_on` is asked all the time.
    ///
    /// # Errors
    /// [`TrialError::Stopped`] where `go_on` said no; what `told` returns.
    pub fn run<E: From<StabilityError>>(
        &self,
        go_on: &dyn Fn() -> bool,
        told: &mut dyn FnMut(Event<'_>) -> Result<(), E>,
    ) -> Result<Record, E> {
        let stage = Stage::new(self.gpu, self.options.kept.clone(), go_on);
        let mut tests = Vec::new();
        for test in &self.options.tests {
            let (finding, sheet) = self.test(&stage, test, told)?;
            told(Event::Done { finding: &finding, sheet: &sheet })?;
            tests.push(finding);
            stage.forget();
        }
        let info = &self.gpu.info;
        let subject = |s: &Subject| SubjectRecord { name: s.name().into(), weights: s.weights_hash() };
        Ok(Record {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION").into(),
            adapter: info.name.clone(),
            backend: format!("{:?}", info.backend).to_lowercase(),
            driver: format!("{} {}", info.driver, info.driver_info).trim().into(),
            software: self.gpu.is_software(),
            subjects: self.options.subjects.iter().map(subject).collect(),
            tests,
        })
    }

    fn test<E: From<StabilityError>>(
        &self,
        stage: &Stage<'_>,
        test: &'static Test,
        told: &mut dyn FnMut(Event<'_>) -> Result<(), E>,
    ) -> Result<(Finding, Sheet), E> {
        let mut finding = Finding::new(test);
        let mut sheet = Sheet::new(test);
        let mut begun = |subject: &str| told(Event::Begun { test, subject });
        let take = |subject: &Subject, fault| {
            let play = Play::new(stage, subject, fault, test.size, test.paths);
            let values = (test.run)(&play);
            (values, play.end())
        };
        // The truth first: the sheet's exposure is its.
        begun("reference")?;
        let (truth, kept) = take(&Subject::Truth, None);
        let truth = keep_going(truth)?;
        begun("control")?;
        let control = keep_going(take(&Subject::Truth, Some(test.control)).0)?;
        let shown = truth.as_ref().map_or("no answer".into(), |v| verdict(test, v));
        sheet.push(Row { name: "reference".into(), verdict: shown, moments: kept.moments, rolls: kept.rolls });
        match (truth, control) {
            (Ok(truth), Ok(control)) => {
                finding.sound = passes(test, &truth) && !passes(test, &control);
                for (i, criterion) in finding.criteria.iter_mut().enumerate() {
                    (criterion.truth, criterion.control) = (Some(truth[i]), Some(control[i]));
                }
            }
            (Err(e), _) | (_, Err(e)) => finding.unsound = Some(e.to_string()),
        }
        for subject in &self.options.subjects {
            begun(subject.name())?;
            if matches!(subject, Subject::Paper(_)) && !test.pictures {
                finding.found.push(not_for_it(subject, "it answers pictures, not light"));
                continue;
            }
            let started = Instant::now();
            let (values, kept) = take(subject, None);
            let mut found = Found {
                subject: subject.name().into(),
                values: Vec::new(),
                pass: None,
                seconds: started.elapsed().as_secs_f64(),
                reason: None,
                instead: kept.instead,
                why: None,
            };
            let shown;
            match keep_going(values)? {
                Ok(values) => {
                    shown = verdict(test, &values);
                    found.pass = Some(passes(test, &values));
                    found.values = values;
                }
                Err(StabilityError::NotForIt(why)) => {
                    finding.found.push(not_for_it(subject, why));
                    continue;
                }
                Err(e) => {
                    shown = "no answer".into();
                    (found.pass, found.reason) = (Some(false), Some(e.to_string()));
                }
            }
            if found.pass == Some(false) {
                found.why = explain::why(test.name, subject.name()).map(Into::into);
            }
            sheet.push(Row {
                name: subject.name().into(),
                verdict: shown,
                moments: kept.moments,
                rolls: kept.rolls,
            });
            finding.found.push(found);
        }
        Ok((finding, sheet))
    }
}

/// An interruption ends everything; any other failure is an answer of its own.
fn keep_going(
    values: Result<Vec<f64>, StabilityError>,
) -> Result<Result<Vec<f64>, StabilityError>, StabilityError> {
    match values {
        Err(StabilityError::Trial(TrialError::Stopped)) => Err(TrialError::Stopped.into()),
        values => Ok(values),
    }
}

fn not_for_it(subject: &Subject, why: &str) -> Found {
    Found {
        subject: subject.name().into(),
        values: Vec::new(),
        pass: None,
        seconds: 0.0,
        reason: Some(why.into()),
        instead: None,
        why: None,
    }
}

/// `pass 0.1 %, 3` or `FAIL 12 %`.
fn verdict(test: &Test, values: &[f64]) -> String {
    let word = if passes(test, values) { "pass" } else { "FAIL" };
    let values = values.iter().zip(test.limits).map(|(v, l)| l.unit.text(*v));
    format!("{word} {}", values.collect::<Vec<_>>().join(", "))
}
