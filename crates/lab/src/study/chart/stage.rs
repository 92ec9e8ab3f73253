//! One scene at work: pictures, scores and times of one entry after the other.

use super::{Scores, Time, Unit, entries::Entry, plan::Plan, published::PIXELS};
use crate::metrics::{Comparison, MetricError};
use crate::reference;
use crate::study::{
    bench::{Measurement, Spread},
    judge::{self, LightError},
    projection::Cost,
    session::{Frame, Session, Settling},
    truth::{self, Reference},
};
use bouncelight::gi::Method;
use bouncelight::scene::Camera;

/// A scene with what it is judged by.
pub(super) struct Stage<'a> {
    pub session: Session<'a>,
    pub camera: Camera,
    pub reference: Reference,
}

impl Stage<'_> {
    /// What is found of an entry; where it comes from is for the caller to say.
    pub fn unit(&mut self, plan: &Plan, entry: &Entry) -> Result<Unit, super::ChartError> {
        match entry {
            Entry::Method { method, .. } => {
                let lit = !matches!(method, Method::Generator(_));
                let settling = Settling { samples: plan.samples, ..Settling::SETTLED };
                let shot = self.session.picture(method, &self.camera, settling)?;
                let mut cold = (None, None);
                if method.has_history() && shot.fallback.is_none() {
                    let first = self.session.picture(method, &self.camera, Settling::COLD)?;
                    let measured = self.session.measure(method, &self.camera, plan.bench, true)?;
                    cold = (Some(self.judged(&first, lit)?), Some(time(&measured)));
                }
                let measured = self.session.measure(method, &self.camera, plan.bench, false)?;
                let costs =
                    if shot.fallback.is_none() { self.session.count(method, &self.camera)? } else { Vec::new() };
                Ok(Unit {
                    scores: Some(self.judged(&shot, lit)?),
                    cold: cold.0,
                    time: Some(time(&measured)),
                    cold_time: cold.1,
                    costs,
                    bytes: measured.total_bytes(),
                    fallback: shot.fallback,
                    ..Unit::default()
                })
            }
            Entry::Paths(count) => {
                let traced = self.session.trace(&self.camera, &plan.paths(truth::samples(*count, 1)))?;
                let light = judge::light_error(traced.layer(reference::Layer::Gi), &self.reference);
                let seen = judge::compare(&traced.rgb(), &self.reference, true)?;
                let ms = 1e3 * traced.seconds;
                let pixels = f64::from(traced.size[0]) * f64::from(traced.size[1]);
                let paths = Cost::new("reference.path", 0.0, 0.0).with_rays(pixels * f64::from(*count));
                Ok(Unit {
                    scores: Some(self.scores(light, &seen)),
                    time: Some(Time { gpu_ms: None, wall_ms: Spread { median: ms, p95: ms } }),
                    costs: vec![paths],
                    ..Unit::default()
                })
            }
        }
    }

    /// `lit`: whether light was found, and not a picture painted.
    fn judged(&self, shot: &Frame, lit: bool) -> Result<Scores, MetricError> {
        let light = lit.then(|| judge::light_error(&shot.added(), &self.reference)).flatten();
        Ok(self.scores(light, &judge::compare(&shot.rgb(), &self.reference, true)?))
    }

    fn scores(&self, light: Option<LightError>, seen: &Comparison) -> Scores {
        let pixels = (seen.width * seen.height) as f64;
        Scores {
            light: light.map(|l| l.error),
            light_bias: light.map(|l| l.bias),
            flip: seen.flip.unwrap_or(f64::NAN),
            l1: seen.paper.l1 * PIXELS / pixels,
            psnr: Some(seen.display.psnr).filter(|v| v.is_finite()),
            relmse: seen.linear.as_ref().map(|l| l.rel_mse),
        }
    }
}

fn time(measured: &Measurement) -> Time {
    Time { gpu_ms: measured.gpu_ms, wall_ms: measured.wall_ms }
}
