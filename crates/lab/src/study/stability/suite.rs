//! Runs tests: the truth, the truth spoilt, then everybody else.

use super::{
    Finding, Found, Record, Sheet, StabilityError, Subject, Test, TestRun, explain,
    record::{Kept, SCHEMA, SubjectRecord, passes},
    sheet::Row,
    test_run::Stage,
};
use crate::study::{device::Device, session::SessionError};
use bouncelight::gpu::Gpu;
use bouncelight_scene::image_io;
use std::{path::PathBuf, time::Instant};

/// What is run, and how.
pub struct SuiteOptions {
    /// Tests, in order.
    pub tests: Vec<&'static Test>,
    /// Who takes them, in order.
    pub subjects: Vec<Subject>,
    /// Folder of references that were traced before.
    pub kept: Option<PathBuf>,
    /// Folder of findings, one file a test; a test whose finding is there and of the same program,
    /// device and subjects is not run again. Without one nothing is kept.
    pub resume: Option<PathBuf>,
}

/// Progress of a run.
pub enum Event<'a> {
    /// A subject has begun a test.
    Begun {
        /// The test.
        test: &'static Test,
        /// Who takes it.
        subject: &'a str,
    },
    /// A test that had been run before.
    Known {
        /// What was found then.
        finding: &'a Finding,
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

    /// Runs all tests. What cannot be drawn is noted in the record and loses nobody else's answer.
    /// `go_on` is asked all the time.
    ///
    /// # Errors
    /// [`SessionError::Stopped`] where `go_on` said no; what `told` returns.
    pub fn run<E: From<StabilityError>>(
        &self,
        go_on: &dyn Fn() -> bool,
        told: &mut dyn FnMut(Event<'_>) -> Result<(), E>,
    ) -> Result<Record, E> {
        let stage = Stage::new(self.gpu, self.options.kept.clone(), go_on);
        let mut tests = Vec::new();
        for test in &self.options.tests {
            if let Some(mut finding) = self.known(test) {
                // Sentences are the program's, not the run's.
                for found in finding.found.iter_mut().filter(|f| f.pass == Some(false)) {
                    found.why = explain::why(test.name, &found.subject).map(Into::into);
                }
                told(Event::Known { finding: &finding })?;
                tests.push(finding);
                continue;
            }
            let (finding, sheet) = self.test(&stage, test, told)?;
            told(Event::Done { finding: &finding, sheet: &sheet })?;
            self.keep(&finding)?;
            tests.push(finding);
            stage.forget();
        }
        let version = env!("CARGO_PKG_VERSION").into();
        Ok(Record { schema: SCHEMA, version, device: Device::of(self.gpu), subjects: self.subjects(), tests })
    }

    fn subjects(&self) -> Vec<SubjectRecord> {
        let subject = |s: &Subject| SubjectRecord { name: s.name().into(), weights: s.weights_hash() };
        self.options.subjects.iter().map(subject).collect()
    }

    fn kept(&self, finding: Finding) -> Kept {
        let (version, device) = (env!("CARGO_PKG_VERSION").into(), self.gpu.sentence());
        Kept { schema: SCHEMA, version, device, subjects: self.subjects(), finding }
    }

    /// What was found before, if that can be read and nothing it depends on has changed.
    fn known(&self, test: &Test) -> Option<Finding> {
        let text = std::fs::read_to_string(self.options.resume.as_ref()?.join(format!("{}.json", test.name))).ok()?;
        let kept: Kept = serde_json::from_str(&text).ok()?;
        kept.is_of(&self.kept(Finding::new(test))).then_some(kept.finding)
    }

    fn keep(&self, finding: &Finding) -> Result<(), StabilityError> {
        let Some(folder) = &self.options.resume else { return Ok(()) };
        let path = folder.join(format!("{}.json", finding.name));
        let text = serde_json::to_string_pretty(&self.kept(finding.clone())).expect("plain data can be written");
        Ok(image_io::write_whole(&path, text.as_bytes())?)
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
        let take = |subject: &Subject, corruption| {
            let run = TestRun::new(stage, subject, corruption, test.size_of(subject), test.paths);
            let values = (test.run)(&run);
            (values, run.end())
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
            if subject.paints() && !test.pictures {
                finding.found.push(not_for_it(subject, "it answers pictures, not light"));
                continue;
            }
            let started = Instant::now();
            let (values, kept) = take(subject, None);
            let seconds = started.elapsed().as_secs_f64();
            let subject_name = subject.name().into();
            let mut found = Found { subject: subject_name, seconds, fallback: kept.fallback, ..Found::default() };
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
            sheet.push(Row { name: subject.name().into(), verdict: shown, moments: kept.moments, rolls: kept.rolls });
            finding.found.push(found);
        }
        Ok((finding, sheet))
    }
}

/// An interruption ends everything; any other failure is an answer of its own.
fn keep_going(values: Result<Vec<f64>, StabilityError>) -> Result<Result<Vec<f64>, StabilityError>, StabilityError> {
    match values {
        Err(StabilityError::Session(SessionError::Stopped)) => Err(SessionError::Stopped.into()),
        values => Ok(values),
    }
}

fn not_for_it(subject: &Subject, why: &str) -> Found {
    Found { subject: subject.name().into(), reason: Some(why.into()), ..Found::default() }
}

/// `pass 0.1 %, 3` or `FAIL 12 %`.
fn verdict(test: &Test, values: &[f64]) -> String {
    let word = if passes(test, values) { "pass" } else { "FAIL" };
    let values = values.iter().zip(test.limits).map(|(v, l)| l.unit.text(*v));
    format!("{word} {}", values.collect::<Vec<_>>().join(", "))
}
