//! The live reference follows what is seen, and both sides are compared when they are whole.

use super::{App, Event};
use crate::viewer::choice::{Side, Source};
use crate::viewer::judge::{self, Pair, Verdict};
use crate::viewer::live::{Kept, Live, Report, Subjects};
use crate::viewer::ui::ReferenceFacts;
use std::time::{Duration, Instant};

/// How long the view has to rest before the path tracer begins anew.
const REST: Duration = Duration::from_millis(250);

/// The path tracer's side of the window.
#[derive(Default)]
pub struct Tracing {
    pub(super) live: Option<Live>,
    pub(super) kept: Kept,
    pub(super) failed: Option<Subjects>,
    /// The view as it was at the last look, and since when it is so.
    pub(super) resting: Option<(Subjects, Instant)>,
    /// How far it is.
    pub facts: Option<ReferenceFacts>,
    /// How far apart both sides are.
    pub verdict: Option<Verdict>,
    /// When both sides are to be compared.
    pub judge_at: Option<Instant>,
    pub(super) judging: Option<u64>,
    judged: u64,
}

impl Tracing {
    /// True while a comparison is due or at work.
    #[cfg(feature = "script")]
    pub fn is_judging(&self) -> bool {
        self.judging.is_some() || self.judge_at.is_some()
    }

    /// Forgets the picture, not what is kept for the next one.
    pub(super) fn forget(&mut self) {
        self.live = None;
        self.facts = None;
        self.failed = None;
    }
}

impl App {
    pub(super) fn reconcile_reference(&mut self) {
        let (Some(stage), Some(shown)) = (&mut self.stage, &self.state.shown) else { return };
        if !self.state.wants_reference() {
            self.tracing.live = None;
            self.tracing.resting = None;
            // What stands in the status line goes with it, and so do numbers that would be another view's
            // when it comes back.
            self.redraw |= self.tracing.facts.take().is_some();
            if self.tracing.verdict.as_ref().is_some_and(|v| v.by.contains(&Source::Reference)) {
                (self.tracing.verdict, self.tracing.judging) = (None, None);
            }
            stage.forget_reference();
            return;
        }
        let camera = self.state.navigator.camera(&shown.scene, self.state.size);
        let subject = Subjects {
            version: self.state.version,
            transform: camera.transform,
            yfov: camera.yfov,
            size: self.state.size,
            samples: self.state.settings.spp,
            denoise: self.state.settings.denoise,
        };
        let now = Instant::now();
        if self.tracing.resting.as_ref().is_none_or(|(s, _)| *s != subject) {
            self.tracing.resting = Some((subject.clone(), now));
            if self.tracing.live.as_ref().is_some_and(|l| l.subject != subject) {
                self.tracing.live = None;
                self.tracing.facts = None;
                stage.forget_reference();
                self.tracing.verdict = None;
            }
        }
        if let Some(live) = &self.tracing.live {
            // Its dispatches would count as the frame's.
            live.pause(self.state.measure);
        }
        let rested = self.tracing.resting.as_ref().is_some_and(|(_, since)| now.duration_since(*since) >= REST);
        if self.tracing.live.is_some() || self.tracing.failed.as_ref() == Some(&subject) {
            return;
        }
        if !rested {
            self.wake(REST);
            return;
        }
        self.tracing.failed = None;
        let proxy = self.proxy.clone();
        let send = move |subject, report| {
            let _ = proxy.send_event(Event::Reference(subject, report));
        };
        let (handles, kept, scene) = (stage.handles(), self.tracing.kept.clone(), shown.scene.clone());
        self.tracing.live = Some(Live::start(handles, kept, scene, (camera, stage.gpu.is_software()), subject, send));
    }

    pub(super) fn on_reference(&mut self, subject: Subjects, report: Report) {
        if self.tracing.live.as_ref().is_none_or(|l| l.subject != subject) {
            return;
        }
        let texel = subject.texel();
        let before = self.tracing.facts.unwrap_or(ReferenceFacts {
            stage: "",
            samples: 0,
            share: 0.0,
            noise: None,
            texel,
            finished: false,
        });
        match report {
            Report::At { stage, samples, share } => {
                self.tracing.facts = Some(ReferenceFacts { stage, samples, share, ..before });
            }
            Report::Picture(found) => {
                let found_samples = found.samples;
                self.tracing.facts = Some(ReferenceFacts {
                    stage: "tracing",
                    samples: found.samples,
                    share: f64::from(found.samples) / f64::from(subject.samples.max(1)),
                    noise: Some(found.noise).filter(|_| found.samples > 0),
                    texel,
                    finished: found.finished,
                });
                if let Some(stage) = &mut self.stage {
                    stage.set_reference(*found);
                }
                let whole = found_samples > 0;
                if whole {
                    self.tracing.judge_at = Some(Instant::now());
                }
            }
            Report::Failed(text) => {
                self.state.notify(format!("reference: {text}"), true);
                self.tracing.live = None;
                self.tracing.failed = Some(subject);
            }
        }
        self.redraw = true;
    }

    /// Compares both sides on a thread, if both are whole.
    pub(super) fn judge(&mut self) {
        if self.state.sources().len() < 2 || self.tracing.judging.is_some() {
            return;
        }
        let Some(stage) = &self.stage else { return };
        let read = |side| stage.read_side(&self.state, side).unwrap_or_default();
        let (Some(left), Some(right)) = (read(Side::Left), read(Side::Right)) else { return };
        let s = &self.state.settings;
        let by = |side| stage.drawn_by(&self.state, side).map(|d| d.source);
        let (Some(first), Some(second)) = (by(Side::Left), by(Side::Right)) else { return };
        let pair = Pair {
            by: [first, second],
            size: self.state.size,
            left,
            right,
            ev: self.state.stops(),
            tonemap: s.tonemap,
        };
        self.tracing.judged += 1;
        let (number, proxy) = (self.tracing.judged, self.proxy.clone());
        self.tracing.judging = Some(number);
        let work = move || {
            let _ = proxy.send_event(Event::Judged(number, judge::judge(&pair)));
        };
        if std::thread::Builder::new().name("judge".into()).spawn(work).is_err() {
            self.tracing.judging = None;
        }
    }
}
