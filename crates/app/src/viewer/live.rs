//! The path tracer beside the window: on a thread of its own, in short dispatches, telling what it
//! has found so far.

use super::jobs::Handles;
use bouncelight::scene::{Camera, Scene};
use bouncelight_lab::reference::{Kernel, Layer, ReferenceScene, Subject, Traced, Tracer, TracerOptions, preview};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Most points that are traced live: 256 bytes for each in two buffers, read back for every
/// picture.
const MOST_POINTS: u64 = 1 << 19;
/// Pixels on a side of what is traced as one in the first picture, which takes a sixteenth of a
/// sample's time.
const COARSE: u32 = 4;
/// Smaller pictures are there at once.
const LEAST: u32 = 160;
/// Least time between two pictures.
const PICTURES: Duration = Duration::from_millis(500);

/// What is traced; another one begins anew.
#[derive(Debug, Clone, PartialEq)]
pub struct Subjects {
    /// Version of the scene.
    pub version: u64,
    pub transform: [[f32; 4]; 4],
    pub yfov: f32,
    pub size: [u32; 2],
    pub samples: u32,
    /// For a look, noise is averaged away.
    pub denoise: bool,
}

impl Subjects {
    /// Pixels on a side of what is traced as one: 1 where the picture is small enough.
    pub fn texel(&self) -> u32 {
        let pixels = |k: u32| self.size.map(|n| u64::from(n.div_ceil(k))).iter().product::<u64>();
        (1..64).find(|&k| pixels(k) <= MOST_POINTS).unwrap_or(64)
    }
}

/// What the thread tells.
pub enum Report {
    /// Packing the scene, compiling, or tracing so many of the samples.
    At {
        stage: &'static str,
        samples: u32,
        share: f64,
    },
    Picture(Box<Found>),
    Failed(String),
}

/// A picture so far.
pub struct Found {
    pub size: [u32; 2],
    pub texel: u32,
    /// RGBA, scene-linear radiance.
    pub radiance: Vec<f32>,
    /// The same with its noise averaged away: to look at, never to compare with.
    pub denoised: Option<Vec<f32>>,
    /// RGB, what a method must add, E/π.
    pub indirect: Vec<f32>,
    /// None while it is a coarse one to begin with.
    pub samples: u32,
    /// Noise of a pixel of the picture, as a share of the mean.
    pub noise: f64,
    pub finished: bool,
}

/// What stays from one subject to the next.
#[derive(Clone, Default)]
pub struct Kept(Arc<Mutex<Option<Packed>>>);

/// Version of the scene, the compiled kernels, the packed scene.
type Packed = (u64, Kernel, Arc<ReferenceScene>);

/// The thread; it ends soon after this is dropped.
pub struct Live {
    pub subject: Subjects,
    stop: Arc<AtomicBool>,
    pause: Arc<AtomicBool>,
}

impl Drop for Live {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

impl Live {
    /// Starts tracing.
    pub fn start(
        handles: Handles,
        kept: Kept,
        scene: Arc<Scene>,
        (camera, software): (Camera, bool),
        subject: Subjects,
        send: impl Fn(Subjects, Report) + Send + 'static,
    ) -> Self {
        let (stop, pause) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
        let work = Work {
            handles,
            kept,
            camera,
            software,
            subject: subject.clone(),
            stop: stop.clone(),
            pause: pause.clone(),
        };
        let spawned = std::thread::Builder::new().name("reference".into()).spawn(move || {
            let told = work.subject.clone();
            if let Err(e) = work.run(scene, &|report| send(told.clone(), report)) {
                send(told.clone(), Report::Failed(e));
            }
        });
        if let Err(e) = spawned {
            tracing::error!("no thread for the reference: {e}");
        }
        Self { subject, stop, pause }
    }

    /// Leaves the GPU alone for as long as `pause` says, which is while frames are measured.
    pub fn pause(&self, pause: bool) {
        self.pause.store(pause, Ordering::Relaxed);
    }
}

struct Work {
    handles: Handles,
    kept: Kept,
    camera: Camera,
    software: bool,
    subject: Subjects,
    stop: Arc<AtomicBool>,
    pause: Arc<AtomicBool>,
}

impl Work {
    fn run(&self, scene: Arc<Scene>, send: &dyn Fn(Report)) -> Result<(), String> {
        let stopped = || self.stop.load(Ordering::Relaxed);
        let Handles { device, queue, .. } = &self.handles;
        let known = self.kept.0.lock().map_err(|e| e.to_string())?.clone();
        send(Report::At { stage: "compiling the path tracer", samples: 0, share: 0.0 });
        let (kernel, packed) = match known {
            Some((version, kernel, packed)) if version == self.subject.version => (kernel, packed),
            known => {
                let kernel = known.map_or_else(|| Kernel::new(device), |(_, kernel, _)| kernel);
                if stopped() {
                    return Ok(());
                }
                send(Report::At { stage: "building the acceleration structure", samples: 0, share: 0.0 });
                let packed = Arc::new(ReferenceScene::new(device, queue, &scene).map_err(|e| e.to_string())?);
                *self.kept.0.lock().map_err(|e| e.to_string())? =
                    Some((self.subject.version, kernel.clone(), packed.clone()));
                (kernel, packed)
            }
        };
        // From here on the scene may be edited without a copy.
        drop(scene);
        let texel = self.subject.texel();
        let size = self.subject.size.map(|n| n.div_ceil(texel));
        let mut layers = vec![Layer::Combined, Layer::Gi];
        if self.subject.denoise {
            layers.extend(preview::READ.into_iter().filter(|l| *l != Layer::Combined));
        }
        let options = TracerOptions {
            samples: self.subject.samples,
            layers,
            // Between two of the window's pictures; on a CPU both take long.
            dispatch: Duration::from_millis(if self.software { 100 } else { 12 }),
            ..Default::default()
        };
        if stopped() {
            return Ok(());
        }
        if size[0].min(size[1]) >= LEAST
            && let Some(found) = self.coarse(&kernel, &packed, &options)?
        {
            send(Report::Picture(Box::new(found)));
        }
        let subject = Subject { camera: &self.camera, size, points: None };
        let mut tracer = Tracer::new(device, queue, &kernel, &packed, subject, options).map_err(|e| e.to_string())?;
        let patience = if self.software { 4 * PICTURES } else { PICTURES };
        let (mut last, mut seen, mut told) = (Instant::now(), 0, Instant::now());
        loop {
            if stopped() {
                return Ok(());
            }
            if self.pause.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(5));
                continue;
            }
            let more = tracer.step().map_err(|e| e.to_string())?;
            let samples = tracer.samples();
            if told.elapsed() > patience / 2 {
                told = Instant::now();
                send(Report::At { stage: "tracing", samples, share: tracer.progress() });
            }
            // Whole passes only: a picture with two samples here and one there flickers.
            let worth = samples > seen && (seen == 0 || last.elapsed() > patience);
            if worth || !more {
                (last, seen) = (Instant::now(), samples);
                let traced = tracer.resolve().map_err(|e| e.to_string())?;
                let (noise, finished) = (traced.noise[0].pixel, !more);
                let found = Found { samples, noise, finished, ..self.found(traced, texel) };
                send(Report::Picture(Box::new(found)));
            }
            if !more {
                return Ok(());
            }
        }
    }

    /// One sample of every fourth pixel of every fourth row: something to look at while the first
    /// whole pass is traced. `None` when nobody waits for it any more.
    fn coarse(
        &self,
        kernel: &Kernel,
        packed: &ReferenceScene,
        options: &TracerOptions,
    ) -> Result<Option<Found>, String> {
        let texel = COARSE * self.subject.texel();
        let size = self.subject.size.map(|n| n.div_ceil(texel));
        let subject = Subject { camera: &self.camera, size, points: None };
        let options = TracerOptions { samples: 1, ..options.clone() };
        let Handles { device, queue, .. } = &self.handles;
        let mut tracer = Tracer::new(device, queue, kernel, packed, subject, options).map_err(|e| e.to_string())?;
        while tracer.step().map_err(|e| e.to_string())? {
            if self.stop.load(Ordering::Relaxed) || self.pause.load(Ordering::Relaxed) {
                return Ok(None);
            }
        }
        Ok(Some(self.found(tracer.resolve().map_err(|e| e.to_string())?, texel)))
    }

    /// A picture that is not done, and whose samples nobody has counted.
    fn found(&self, traced: &Traced, texel: u32) -> Found {
        let layer = |l| traced.layer(l).map(<[f32]>::to_vec).unwrap_or_default();
        Found {
            size: traced.size,
            texel,
            radiance: layer(Layer::Combined),
            denoised: if self.subject.denoise { preview::denoise(traced, &self.camera) } else { None },
            indirect: layer(Layer::Gi),
            samples: 0,
            noise: f64::NAN,
            finished: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_windows_are_traced_coarser() {
        let of = |size| {
            Subjects { version: 0, transform: [[0.0; 4]; 4], yfov: 1.0, size, samples: 1, denoise: false }.texel()
        };
        assert_eq!((of([640, 360]), of([1024, 512]), of([1920, 1080]), of([7680, 4320])), (1, 1, 2, 8));
    }
}
