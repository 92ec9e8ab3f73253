//! The work, piece by piece: what is done stays done, what fails loses nothing else.

use super::{
    ChartError, Kind, Metric, Provenance, Record, SceneFacts, Unit,
    entries::Entry,
    plan::Plan,
    published,
    scenes::{self, Source},
    stage::Stage,
};
use crate::reference;
use crate::study::{
    device::Device,
    hash, judge,
    session::{Session, SessionError, SessionOptions},
    truth,
};
use bouncelight::gpu::Gpu;
use bouncelight::render::capture::Layer;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};

/// Seed of references; what is judged has another.
const REFERENCE_SEED: u32 = 20_001;

/// Who looks on.
pub struct Hooks<'a> {
    /// Told how much of how much is done, in parts of the work, and what comes next.
    pub tell: &'a dyn Fn(f64, f64, &str),
    /// Told of what goes wrong with a piece.
    pub warn: &'a dyn Fn(&str),
    /// Asked whether to go on.
    pub go_on: &'a dyn Fn() -> bool,
    /// Given the record after every piece, to be kept.
    pub save: &'a dyn Fn(&Record) -> Result<(), ChartError>,
}

/// Does what `plan` says. Pieces that `before` holds under the same key (same program, device,
/// scene, numbers) are not done again.
///
/// # Errors
/// [`ChartError::Stopped`] (what was done has been saved by then); folders of references that
/// cannot be read; saving.
pub fn run(
    gpu: &Gpu,
    plan: &Plan,
    before: Option<Record>,
    provenance: Provenance,
    hooks: &Hooks<'_>,
) -> Result<Record, ChartError> {
    let faults = Faults::watch(gpu);
    let before = before.unwrap_or_default();
    let record = Record {
        schema: 1,
        provenance,
        device: Device::of(gpu),
        size: plan.size,
        samples: plan.samples,
        frames: [plan.bench.frames, plan.bench.warmup],
        reference: plan.reference,
        no_caustics: plan.no_caustics,
        entries: plan.entries.iter().map(Entry::facts).collect(),
        ..Record::default()
    };
    let all = plan.work();
    let mut work = Work { gpu, plan, before, record, hooks, faults, done: 0.0, all };
    for source in &plan.sources {
        work.scene(source)?;
    }
    if plan.generator {
        work.generator()?;
    }
    Ok(work.record)
}

/// What the driver refused since it was last asked.
struct Faults(Arc<Mutex<Vec<String>>>);

impl Faults {
    fn watch(gpu: &Gpu) -> Self {
        let list = Arc::new(Mutex::new(Vec::new()));
        let theirs = list.clone();
        gpu.device.on_uncaptured_error(Arc::new(move |e| {
            if let Ok(mut list) = theirs.lock() {
                list.push(e.to_string());
            }
        }));
        Self(list)
    }

    fn take(&self) -> Option<String> {
        let mut list = self.0.lock().ok()?;
        let first = list.drain(..).next();
        first.map(|text| text.lines().take(3).collect::<Vec<_>>().join(" "))
    }
}

struct Work<'a> {
    gpu: &'a Gpu,
    plan: &'a Plan,
    before: Record,
    record: Record,
    hooks: &'a Hooks<'a>,
    faults: Faults,
    done: f64,
    all: f64,
}

impl<'a> Work<'a> {
    /// Everything that decides a result but the piece itself.
    fn key(&self, of: &impl std::fmt::Debug) -> String {
        let Plan { samples, bench, reference, no_caustics, .. } = self.plan;
        let here = (&self.record.device, &self.record.provenance.program);
        hash::of_text(&(here, samples, bench, reference, no_caustics, of))
    }

    fn begin(&self, what: &str) -> Result<(), ChartError> {
        if !(self.hooks.go_on)() {
            return Err(ChartError::Stopped);
        }
        (self.hooks.tell)(self.done, self.all, what);
        Ok(())
    }

    fn end(&mut self, parts: f64) -> Result<(), ChartError> {
        self.done += parts;
        // What is not done yet stays from the run before, so that one that is cut off again loses
        // nothing.
        let mut kept = self.record.clone();
        let missing = |u: &&Unit| !self.record.units.iter().any(|n| n.key == u.key);
        kept.units.extend(self.before.units.iter().filter(missing).cloned());
        kept.generator = kept.generator.or_else(|| self.before.generator.clone());
        (self.hooks.save)(&kept)
    }

    /// Runs `piece`; a panic, and what the driver refuses meanwhile, are errors like others.
    fn guarded<T>(&self, piece: impl FnOnce() -> Result<T, ChartError>) -> Result<T, ChartError> {
        let done = catch_unwind(AssertUnwindSafe(piece)).unwrap_or_else(|panic| {
            let text = panic.downcast_ref::<String>().cloned();
            let text = text.or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()));
            Err(ChartError::Driver(text.unwrap_or_else(|| "the program broke off".into())))
        });
        match self.faults.take() {
            Some(refused) => Err(ChartError::Driver(refused)),
            None => done,
        }
    }

    fn scene(&mut self, source: &Source) -> Result<(), ChartError> {
        self.begin(&format!("{}: reference", source.name))?;
        let entries: f64 = self.plan.entries.iter().map(|e| self.plan.parts(e)).sum();
        let parts = self.plan.reference_parts(source);
        match self.guarded(|| self.prepare(source)) {
            Err(ChartError::Stopped | ChartError::Session(SessionError::Stopped)) => Err(ChartError::Stopped),
            Err(e) => {
                (self.hooks.warn)(&format!("{} is left out: {e}", source.name));
                let failed = Some(e.to_string());
                let (name, hash, reference) = (source.name.clone(), String::new(), String::new());
                let size = self.plan.size;
                self.record.scenes.push(SceneFacts { name, hash, size, reference, samples: None, noise: None, failed });
                self.end(parts + entries)
            }
            Ok((mut stage, facts)) => {
                self.record.scenes.push(facts);
                self.end(parts)?;
                for entry in &self.plan.entries {
                    self.unit(source, entry, &mut stage)?;
                }
                Ok(())
            }
        }
    }

    fn prepare(&self, source: &Source) -> Result<(Stage<'a>, SceneFacts), ChartError> {
        let scene = source.load(self.plan.load)?;
        let camera = scene.cameras[0].clone();
        let size = source.reference_size()?.unwrap_or(self.plan.size);
        let mut layers = crate::study::session::LAYERS.to_vec();
        layers.push(Layer::GlossCol);
        let options = SessionOptions { layers, kept: Some(self.plan.kept.clone()), ..SessionOptions::default() };
        let hooks = self.hooks;
        let (done, all, name) = (self.done, self.all, source.name.clone());
        let parts = self.plan.reference_parts(source);
        let mut session = Session::new(self.gpu, scene, size, options)?;
        let tracing = std::rc::Rc::new(std::cell::Cell::new(true));
        let told = tracing.clone();
        session = session.watched(move |share| {
            if told.get() {
                (hooks.tell)(done + share * parts, all, &format!("{name}: reference"));
            }
            (hooks.go_on)()
        });
        let (error, most) = self.plan.reference;
        let reference = match &source.reference {
            Some(path) => scenes::reference(path, &mut session, self.plan.samples)?,
            None => {
                let options = truth::until(reference::Layer::Gi, error, most, REFERENCE_SEED);
                session.reference(&camera, &self.plan.paths(options))?
            }
        };
        tracing.set(false);
        let traced = source.reference.is_none();
        let noise = reference.light_noise();
        let facts = SceneFacts {
            name: source.name.clone(),
            hash: session.hash().to_owned(),
            size,
            reference: source.origin(),
            samples: if traced { Some(reference.samples) } else { source.samples.map(|n| [n; 2]) },
            noise: (traced && noise.is_finite()).then_some([noise, noise / judge::BLOCK as f64]),
            failed: None,
        };
        Ok((Stage { session, camera, reference }, facts))
    }

    fn unit(&mut self, source: &Source, entry: &Entry, stage: &mut Stage<'a>) -> Result<(), ChartError> {
        let (name, parts) = (entry.name(), self.plan.parts(entry));
        self.begin(&format!("{}: {name}", source.name))?;
        let seen = (stage.session.hash().to_owned(), hash::of_camera(&stage.camera), stage.session.size());
        let key = self.key(&(entry.key(), seen, source));
        let known = |units: &[Unit]| units.iter().find(|u| u.key == key && u.failed.is_none()).cloned();
        let unit = match known(&self.before.units) {
            Some(unit) => unit,
            None => {
                let done = self.guarded(|| stage.unit(self.plan, entry));
                match done {
                    Err(ChartError::Stopped | ChartError::Session(SessionError::Stopped)) => {
                        return Err(ChartError::Stopped);
                    }
                    Err(e) => {
                        (self.hooks.warn)(&format!("{name} failed in {}: {e}", source.name));
                        Unit { failed: Some(e.to_string()), ..Unit::default() }
                    }
                    Ok(found) => {
                        if let Some(why) = &found.fallback {
                            (self.hooks.warn)(&format!("{name} is not drawn in {}: {why}", source.name));
                        }
                        Unit { failed: found.fallback.clone(), ..found }
                    }
                }
            }
        };
        self.record.units.push(Unit { key, scene: source.name.clone(), entry: name, ..unit });
        self.end(parts)
    }

    fn generator(&mut self) -> Result<(), ChartError> {
        self.begin("the paper's generator")?;
        let (gpu, size, bench) = (self.gpu, self.plan.size, self.plan.bench);
        let key = self.key(&("generator", size));
        let known = self.before.generator.take().filter(|g| g.key == key && g.failed.is_none());
        let found = match known {
            Some(found) => found,
            None => {
                let made = self.guarded(|| Ok(published::generator(gpu, size, bench, key.clone())));
                made.unwrap_or_else(|e| published::Generator {
                    key,
                    size,
                    parameters: 0,
                    costs: Vec::new(),
                    wall_ms: None,
                    failed: Some(e.to_string()),
                })
            }
        };
        if let Some(why) = &found.failed {
            (self.hooks.warn)(&format!("the paper's generator was not run: {why}"));
        }
        self.record.generator = Some(found);
        self.end(4.0 * f64::from(bench.frames + bench.warmup))
    }
}

/// Warnings about a finished record that a reader must see, one sentence each.
pub fn missing(record: &Record, metric: Metric) -> Vec<String> {
    let scenes = record.scenes.iter().filter_map(|s| Some(format!("scene {}: {}", s.name, s.failed.as_ref()?)));
    let units = record.units.iter().filter_map(|u| Some(format!("{} in {}: {}", u.entry, u.scene, u.failed.as_ref()?)));
    // A network on pictures has no light of its own, which is no failure.
    let unjudged = record.units.iter().filter(|u| {
        u.failed.is_none()
            && record.kind(&u.entry) != Some(Kind::Pictures)
            && u.scores.as_ref().is_some_and(|s| metric.of(s).is_none())
    });
    let unjudged = unjudged.map(|u| format!("{} in {}: has no {} to compare", u.entry, u.scene, metric.name()));
    scenes.chain(units).chain(unjudged).collect()
}
