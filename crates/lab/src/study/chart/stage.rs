//! One scene at work: pictures, scores and times of one entry after the other.

use super::{
    Scores, Time, Unit,
    entries::Entry,
    plan::Plan,
    published::{self, PIXELS},
};
use crate::metrics::{Comparison, MetricError};
use crate::reference;
use crate::study::{
    bench::{Measurement, Spread},
    judge::{self, LightError},
    on_pictures,
    projection::Cost,
    session::{Frame, Session, Settling},
    truth::{self, Reference},
};
use bouncelight::gi::Method;
use bouncelight::gpu::Gpu;
use bouncelight::scene::Camera;

/// A scene with what it is judged by.
pub(super) struct Stage<'a> {
    pub session: Session<'a>,
    pub camera: Camera,
    pub reference: Reference,
}

impl Stage<'_> {
    /// What is found of an entry; where it comes from is for the caller to say.
    pub fn unit(&mut self, gpu: &Gpu, plan: &Plan, entry: &Entry) -> Result<Unit, super::ChartError> {
        match entry {
            Entry::Method { method, .. } => {
                let settling = Settling { samples: plan.samples, ..Settling::SETTLED };
                let shot = self.session.picture(method, &self.camera, settling)?;
                let mut cold = (None, None);
                if method.has_history() && shot.fallback.is_none() {
                    let first = self.session.picture(method, &self.camera, Settling::COLD)?;
                    let measured = self.session.measure(method, &self.camera, plan.bench, true)?;
                    cold = (Some(self.judged(&first)?), Some(time(&measured)));
                }
                let measured = self.session.measure(method, &self.camera, plan.bench, false)?;
                let costs =
                    if shot.fallback.is_none() { self.session.count(method, &self.camera)? } else { Vec::new() };
                Ok(Unit {
                    scores: Some(self.judged(&shot)?),
                    cold: cold.0,
                    time: Some(time(&measured)),
                    cold_time: cold.1,
                    costs,
                    bytes: measured.total_bytes(),
                    fallback: shot.fallback,
                    ..Unit::default()
                })
            }
            Entry::Pictures { weights, .. } => {
                let direct = Method::Direct;
                let settling = Settling { frames: 1, samples: plan.samples };
                let shot = self.session.picture(&direct, &self.camera, settling)?;
                let sky = self.session.scene().environment.radiance;
                let network = published::network(gpu, weights, self.session.size())?;
                let shown = on_pictures::picture::<super::ChartError>(gpu, (weights, &network), &shot, sky)?;
                // A saved picture has 8 bits.
                let shown: Vec<f32> = shown.into_iter().map(|v| (v * 255.0).round() / 255.0).collect();
                let raster = self.session.measure(&direct, &self.camera, plan.bench, false)?;
                let (frame, own) = (raster.wall_ms, published::time(gpu, &network, plan.bench)?);
                let wall_ms = Spread { median: frame.median + own.median, p95: frame.p95 + own.p95 };
                let seen = judge::compare_shown(&shown, &self.reference, true)?;
                Ok(Unit {
                    scores: Some(self.scores(None, &seen)),
                    time: Some(Time { gpu_ms: None, wall_ms }),
                    costs: published::costs(&network),
                    bytes: raster.total_bytes() + network.bytes(),
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

    fn judged(&self, shot: &Frame) -> Result<Scores, MetricError> {
        let light = judge::light_error(&shot.added(), &self.reference);
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
