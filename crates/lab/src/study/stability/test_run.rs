//! Who draws what a test asks for: a method frame by frame with its history, or the path tracer.

use super::{Corruption, Script, StabilityError, observation::Observation, sheet::Moment};
use crate::reference::{Kernel, Layer as TracedLayer, TracerOptions};
use crate::study::{
    hash,
    session::{Frame, Session, SessionError, SessionOptions},
    truth,
};
use bouncelight::gi::Method;
use bouncelight::gpu::Gpu;
use bouncelight::render::capture::Layer;
use bouncelight::scene::{Camera, Scene};
use std::{
    cell::{Cell, OnceCell, RefCell},
    collections::HashMap,
    path::PathBuf,
    rc::Rc,
};

/// Who draws.
#[derive(Debug, Clone)]
pub enum Subject {
    /// A real-time method.
    Method {
        /// Name for tables.
        name: String,
        /// The method.
        method: Method,
    },
    /// The path tracer.
    Truth,
}

impl Subject {
    /// Name in tables and records.
    pub fn name(&self) -> &str {
        match self {
            Subject::Method { name, .. } => name,
            Subject::Truth => "reference",
        }
    }

    /// Whether it paints a picture and finds no light.
    pub fn paints(&self) -> bool {
        matches!(self, Subject::Method { method: Method::Generator(_), .. })
    }

    /// Hash of its weights, if it has any.
    pub fn weights_hash(&self) -> Option<String> {
        match self {
            Subject::Method { method: Method::Neural(neural) | Method::Generator(neural), .. } => {
                Some(neural.weights.hash_text())
            }
            _ => None,
        }
    }
}

/// What all tests share: the device, the compiled path tracer, pictures that were traced before.
pub(super) struct Stage<'a> {
    pub gpu: &'a Gpu,
    pub kept: Option<PathBuf>,
    pub go_on: &'a dyn Fn() -> bool,
    kernel: OnceCell<Kernel>,
    traced: RefCell<HashMap<String, Rc<Observation>>>,
}

impl<'a> Stage<'a> {
    pub fn new(gpu: &'a Gpu, kept: Option<PathBuf>, go_on: &'a dyn Fn() -> bool) -> Self {
        Self { gpu, kept, go_on, kernel: OnceCell::new(), traced: RefCell::default() }
    }

    fn kernel(&self) -> Kernel {
        self.kernel.get_or_init(|| Kernel::new(&self.gpu.device)).clone()
    }

    /// Forgets the pictures that are in memory: the next test has other scenes.
    pub fn forget(&self) {
        self.traced.borrow_mut().clear();
    }
}

/// What a play leaves behind beside its numbers.
pub(super) struct Kept {
    /// For the contact sheet.
    pub moments: Vec<Moment>,
    /// For the short sequence.
    pub rolls: Vec<Moment>,
    /// Why another method drew in this one's place, if one did.
    pub fallback: Option<String>,
}

/// One test drawn by one subject.
pub struct TestRun<'a> {
    pub(super) stage: &'a Stage<'a>,
    subject: &'a Subject,
    corruption: Option<Corruption>,
    size: [u32; 2],
    paths: u32,
    moments: RefCell<Vec<Moment>>,
    rolls: RefCell<Vec<Moment>>,
    frames: Cell<u64>,
    fallback: RefCell<Option<String>>,
}

impl<'a> TestRun<'a> {
    pub(super) fn new(
        stage: &'a Stage<'a>,
        subject: &'a Subject,
        corruption: Option<Corruption>,
        size: [u32; 2],
        paths: u32,
    ) -> Self {
        let (moments, rolls, fallback) = (RefCell::default(), RefCell::default(), RefCell::default());
        Self { stage, subject, corruption, size, paths, moments, rolls, frames: Cell::new(0), fallback }
    }

    /// Whether the path tracer draws. It has no history and takes seconds a frame, so tests ask it
    /// for fewer frames.
    pub fn is_truth(&self) -> bool {
        matches!(self.subject, Subject::Truth)
    }

    /// Who draws.
    pub fn subject(&self) -> &Subject {
        self.subject
    }

    /// What is true of a still scene, not spoilt, whoever draws; the picture for light, where a generator does.
    pub fn truth(&self, scene: &Scene, camera: &Camera) -> Result<Observation, StabilityError> {
        let mut looks = self.traced(scene, self.size, &Script::new().look(camera))?;
        let mut look = looks.pop().expect("one frame was wanted");
        if self.subject.paints() {
            look.light = look.rgb.clone();
        }
        Ok(look)
    }

    /// The same test drawn by another subject.
    pub fn as_other<'b>(&'b self, subject: &'b Subject) -> TestRun<'b> {
        TestRun::new(self.stage, subject, self.corruption, self.size, self.paths)
    }

    /// Keeps frames for the short sequence.
    pub fn roll(&self, looks: &[Observation]) {
        self.rolls.borrow_mut().extend((1..).zip(looks).map(|(i, l)| Moment::new(&format!("{i}"), l)));
    }

    /// Keeps a look for the contact sheet.
    pub fn keep(&self, name: &str, look: &Observation) {
        self.moments.borrow_mut().push(Moment::new(name, look));
    }

    /// What was kept.
    pub(super) fn end(self) -> Kept {
        Kept {
            moments: self.moments.into_inner(),
            rolls: self.rolls.into_inner(),
            fallback: self.fallback.into_inner(),
        }
    }

    /// A look at a still scene after so many frames.
    pub fn settled(&self, scene: &Scene, camera: &Camera, frames: usize) -> Result<Observation, StabilityError> {
        let mut looks = self.render_sequence(scene, Script::new().rest(camera, frames - 1).look(camera))?;
        Ok(looks.pop().expect("one frame was wanted"))
    }

    /// Draws a script; the frames that it wants.
    pub fn render_sequence(&self, scene: &Scene, script: Script) -> Result<Vec<Observation>, StabilityError> {
        self.render_sequence_at(scene, self.size, script)
    }

    /// As [`Self::render_sequence`], at another size than the test's.
    pub fn render_sequence_at(
        &self,
        scene: &Scene,
        size: [u32; 2],
        script: Script,
    ) -> Result<Vec<Observation>, StabilityError> {
        let mut looks = match self.subject {
            Subject::Method { method, .. } => self.drawn(method, scene, size, &script)?,
            Subject::Truth => self.traced(scene, size, &script)?,
        };
        if let Some(corruption) = self.corruption {
            let wanted: Vec<u32> = (0..).zip(&script.0).filter(|(_, f)| f.wanted).map(|(i, _)| i).collect();
            let mut before: Option<(u32, Observation)> = None;
            for (look, number) in looks.iter_mut().zip(wanted) {
                self.frames.set(self.frames.get() + 1);
                let passed = before.as_ref().map_or(0, |(n, _)| number - n);
                corruption.spoil(look, self.frames.get(), before.as_ref().map(|(_, l)| l), passed);
                before = Some((number, look.clone()));
            }
        }
        Ok(looks)
    }

    fn session(&self, scene: &Scene, size: [u32; 2], layers: &[Layer]) -> Result<Session<'a>, SessionError> {
        let options =
            SessionOptions { layers: layers.to_vec(), kept: self.stage.kept.clone(), ..SessionOptions::default() };
        let go_on = self.stage.go_on;
        Ok(Session::new(self.stage.gpu, scene.clone(), size, options)?.watched(move |_| go_on()))
    }

    fn drawn(
        &self,
        method: &Method,
        scene: &Scene,
        size: [u32; 2],
        script: &Script,
    ) -> Result<Vec<Observation>, StabilityError> {
        let mut session = self.session(scene, size, &[Layer::DiffInd, Layer::Depth, Layer::Normal])?;
        let script = if method.has_history() { script.clone() } else { script.wanted_only() };
        let mut cameras = script.0.iter().filter(|f| f.wanted).map(|f| f.camera.clone());
        let mut looks = Vec::new();
        let mut take = |shot: Frame| {
            if let Some(why) = &shot.fallback {
                *self.fallback.borrow_mut() = Some(format!("`{}` drew: {why}", shot.drawn_by));
            }
            let camera = cameras.next().expect("a camera for each wanted frame");
            let mut look = look_of(&shot, camera);
            if self.subject.paints() {
                look.light = look.rgb.clone();
            }
            looks.push(look);
        };
        let mut change = |number: u32| script.0[number as usize].clone();
        session.render_sequence(method, &mut change, script.0.len() as u32, &mut take)?;
        Ok(looks)
    }

    fn traced(&self, scene: &Scene, size: [u32; 2], script: &Script) -> Result<Vec<Observation>, StabilityError> {
        let mut session = self.session(scene, size, &[])?;
        session.share_kernel(self.stage.kernel());
        // Through the pixels' centres, as the methods look.
        let options = TracerOptions { filter_width: 0.0, ..truth::samples(self.paths, 0) };
        let mut looks = Vec::new();
        for frame in script.wanted_only().0 {
            session.edit(&frame.edits)?;
            let key = format!("{} {} {size:?} {}", session.hash(), hash::of_camera(&frame.camera), self.paths);
            let known = self.stage.traced.borrow().get(&key).cloned();
            let look = match known {
                Some(look) => look,
                None => {
                    let reference = session.reference(&frame.camera, &options)?;
                    let data = |layer| reference.layer(layer).to_vec();
                    let look = Rc::new(Observation {
                        size,
                        light: data(TracedLayer::Gi),
                        rgb: reference.rgb(),
                        depth: data(TracedLayer::Depth),
                        normal: data(TracedLayer::Normal),
                        broken: 0,
                        camera: frame.camera.clone(),
                    });
                    self.stage.traced.borrow_mut().insert(key, look.clone());
                    look
                }
            };
            looks.push(look.as_ref().clone());
        }
        Ok(looks)
    }
}

fn look_of(shot: &Frame, camera: Camera) -> Observation {
    let data = |layer| shot.layer(layer).data.clone();
    let size = [shot.frame.beauty.width as u32, shot.frame.beauty.height as u32];
    let (light, rgb) = (data(Layer::DiffInd), shot.rgb());
    Observation { size, light, rgb, depth: data(Layer::Depth), normal: data(Layer::Normal), broken: 0, camera }
}
