//! The cheapest method that is good enough for a scene: no more model than it needs.
//!
//! A few views are traced to the error that the target asks for and no further. Then candidates are
//! tried from the cheapest up, and the first that meets the target in every view ends the search;
//! what is dearer is not tried. Free numbers: the light of `ambient` and `ssgi` is linear in two of
//! them, so where the usual ones miss the target, the scene's own follow from three pictures a
//! view. Of `gather` the usual ones are tried first: where they are good enough, cheaper ones are
//! sought by bisection, where not, finer ones are candidates of their own. At last, for methods
//! that settle, the fewest frames that still meet the target are sought by bisection, too. Both
//! bisections take it that error falls as cost rises; what they return has been measured to meet
//! the target in any case.

mod ambient_term;
mod quality_target;
mod report;
mod rows;
mod views;

pub use quality_target::{Metric, QualityTarget};
pub use report::{Record, RecordRow};
pub use rows::{Candidate, Row, Verdict};
pub use views::covering;

use super::{
    count::CountError,
    projection::{GTX_1050, modelled},
    session::{Frame, Session, SessionError, Settling},
    truth::Reference,
};
use bouncelight::gi::{Neural, gather, name::MethodName};
use bouncelight::render::capture::Layer;
use bouncelight::scene::Camera;
use std::path::PathBuf;

/// Sizes of `gather`'s entries over their distance, coarser and finer than its own, of which half
/// the size is four times as many.
const COARSER: [f32; 3] = [1.0 / 8.0, 1.0 / 4.0, 1.0 / 2.0];
const FINER: [f32; 2] = [1.0 / 32.0, 1.0 / 64.0];

/// Why nothing could be fitted.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// A picture could not be drawn or traced.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// Nothing to look at.
    #[error(
        "there is no view to judge: the scene has no camera that sees a surface; name one with --eye and --look-at"
    )]
    NoViews,
    /// The metric says nothing of a view.
    #[error("view {view}: {reason}; choose another view or metric")]
    Blind {
        /// Its number, from 0.
        view: usize,
        /// What is missing.
        reason: String,
    },
}

/// A network that may be chosen.
pub struct Network {
    /// What the record calls its weights: a file, or a shipped name.
    pub file: PathBuf,
    /// The network, ready to run on this device.
    pub neural: Neural,
}

/// What is asked for.
pub struct FitOptions {
    /// What is measured, and the bound that must hold in every view.
    pub quality_target: QualityTarget,
    /// Most milliseconds of a method's own passes; what is dearer is not tried.
    pub budget_ms: Option<f64>,
    /// Frames of a still camera, for methods that settle.
    pub frames: u32,
    /// Networks beside the other methods.
    pub networks: Vec<Network>,
    /// Most samples a pixel of a reference.
    pub max_samples: u32,
    /// Costs are measured on this device; else modelled from counted work.
    pub timed: bool,
}

/// A view and its truth.
pub struct Seen {
    /// From where.
    pub camera: Camera,
    /// The path-traced picture.
    pub reference: Reference,
    /// What the metric would say of the reference's own noise; 0 for metrics that cannot tell.
    pub floor: f64,
}

/// What was found.
pub struct Fit {
    /// Everything that was tried, in that order, and what was not.
    pub rows: Vec<Row>,
    /// Index of the row that is chosen.
    pub chosen: usize,
    /// It meets the target; else it is the nearest to it within the budget.
    pub reached: bool,
    /// The views.
    pub views: Vec<Seen>,
}

impl Fit {
    /// The row that is chosen.
    pub fn choice(&self) -> &Row {
        &self.rows[self.chosen]
    }

    /// The largest of the views' floors.
    pub fn floor(&self) -> f64 {
        self.views.iter().map(|v| v.floor).fold(0.0, f64::max)
    }
}

/// Looks for it. Blocks, for minutes on a slow device; `told` hears what is being done and how many
/// steps of how many are done.
///
/// # Errors
/// [`FitError`]. That the target is out of reach is no error: [`Fit::reached`].
pub fn fit(
    session: &mut Session<'_>,
    cameras: &[Camera],
    options: &FitOptions,
    told: &mut dyn FnMut(&str, u32, u32),
) -> Result<Fit, FitError> {
    let mut search =
        Search { session, options, views: Vec::new(), rows: Vec::new(), costs: Vec::new(), told, done: 0, expected: 0 };
    search.expected = search.guess(cameras.len());
    search.trace(cameras)?;
    let found = search.climb()?;
    let (chosen, reached) = match found {
        Some(row) => (search.refine(row)?, true),
        None => (search.nearest().expect("`direct` draws every scene and costs nothing"), false),
    };
    search.settle(chosen, reached)?;
    Ok(Fit { rows: search.rows, chosen, reached, views: search.views })
}

/// The metric in each view, and the pictures.
type Judged = (Vec<f64>, Vec<Frame>);

struct Search<'a, 'b> {
    session: &'a mut Session<'b>,
    options: &'a FitOptions,
    views: Vec<Seen>,
    rows: Vec<Row>,
    /// What candidates were found to cost.
    costs: Vec<(Candidate, Option<f64>)>,
    told: &'a mut dyn FnMut(&str, u32, u32),
    done: u32,
    expected: u32,
}

impl Search<'_, '_> {
    /// Steps that there will be if nothing ends the search early: a reference or a candidate in one
    /// view each.
    fn guess(&self, views: usize) -> u32 {
        (views * (1 + 4 + FINER.len() + self.options.networks.len())) as u32
    }

    fn tell(&mut self, what: &str) {
        self.expected = self.expected.max(self.done + 1);
        (self.told)(what, self.done, self.expected);
        self.done += 1;
    }

    fn trace(&mut self, cameras: &[Camera]) -> Result<(), FitError> {
        let options = self.options.quality_target.reference(self.options.max_samples);
        for (view, camera) in cameras.iter().enumerate() {
            self.tell(&format!("reference of view {view}"));
            let reference = self.session.reference(camera, &options)?;
            let floor = self.options.quality_target.noise(&reference);
            let floor = floor.map_err(|reason| FitError::Blind { view, reason })?;
            self.views.push(Seen { camera: camera.clone(), reference, floor });
        }
        if self.views.is_empty() { Err(FitError::NoViews) } else { Ok(()) }
    }

    /// From the cheapest up to the first that is good enough.
    fn climb(&mut self) -> Result<Option<usize>, FitError> {
        let finer = FINER.map(|entry_scale| Candidate::gather(gather::Options { entry_scale, ..Default::default() }));
        let networks = (0..self.options.networks.len()).map(Candidate::network);
        let mut upper: Vec<Candidate> = finer.into_iter().chain(networks).collect();
        let plain = MethodName::LIGHT.iter().rev().filter(|method| !method.needs_weights());
        let mut ladder: Vec<Candidate> = plain.map(|method| Candidate::plain(*method)).collect();
        while let Some(candidate) = ladder.pop() {
            let mut tried = self.attempt(candidate, self.options.frames)?;
            if tried.is_some_and(|row| self.rows[row].verdict == Verdict::TooFar)
                && let Some(own) = self.own_numbers(tried)?
            {
                tried = self.attempt(own, self.options.frames)?;
            }
            if let Some(enough) = tried.filter(|row| self.rows[*row].verdict == Verdict::GoodEnough) {
                let rest = ladder.into_iter().rev().chain(upper);
                let rest: Vec<Row> = rest.map(|candidate| Row::blank(candidate, Verdict::NotNeeded)).collect();
                self.rows.extend(rest);
                return Ok(Some(enough));
            }
            if ladder.is_empty() && !upper.is_empty() {
                // What these cost is not known before they are built.
                let mut costed = Vec::new();
                let gather = |row: &Row| row.candidate.method == MethodName::Gather;
                let too_dear = self.rows.iter().any(|row| gather(row) && row.verdict == Verdict::TooDear);
                for candidate in upper.drain(..) {
                    // Finer than what is over the budget.
                    if too_dear && candidate.method == MethodName::Gather {
                        self.rows.push(Row::blank(candidate, Verdict::TooDear));
                        continue;
                    }
                    let cost = self.cost(&candidate)?;
                    costed.push((cost.unwrap_or(f64::INFINITY), candidate));
                }
                costed.sort_by(|a, b| b.0.total_cmp(&a.0));
                ladder.extend(costed.into_iter().map(|(_, candidate)| candidate));
            }
        }
        Ok(None)
    }

    /// A candidate whose light is linear in two numbers, with those that suit these views best;
    /// `None` for the others.
    fn own_numbers(&mut self, row: Option<usize>) -> Result<Option<Candidate>, FitError> {
        let Some(candidate) = row.map(|row| self.rows[row].candidate.clone()) else { return Ok(None) };
        let mut problem = ambient_term::Problem::default();
        for view in 0..self.views.len() {
            let mut light = Vec::new();
            for numbers in ambient_term::ASKED {
                let Some(asked) = candidate.with_ambient_term(numbers) else { return Ok(None) };
                self.tell(&format!("{} in view {view}", asked.name(&self.options.networks)));
                let method = asked.method(&self.options.networks);
                let shot = self.session.picture(&method, &self.views[view].camera, Settling::COLD)?;
                light.push(shot.layer(Layer::DiffInd).data.clone());
            }
            problem.add(&light, &self.views[view].reference);
        }
        Ok(problem.solve().and_then(|own| candidate.with_ambient_term(own)))
    }

    /// Cheaper numbers of a candidate that is good enough, if they are, too; else the row itself.
    fn refine(&mut self, row: usize) -> Result<usize, FitError> {
        let candidate = &self.rows[row].candidate;
        if candidate.method != MethodName::Gather {
            return Ok(row);
        }
        let found = candidate.gather.unwrap_or_default();
        let own = gather::Options::default().entry_scale;
        if found.entry_scale < own {
            // The coarser ones have been tried on the way here.
            return Ok(row);
        }
        let (mut best, mut low, mut high) = (row, 0, COARSER.len());
        while low < high {
            let middle = (low + high) / 2;
            let candidate = Candidate::gather(gather::Options { entry_scale: COARSER[middle], ..found });
            match self.attempt(candidate, self.options.frames)? {
                Some(tried) if self.rows[tried].verdict == Verdict::GoodEnough => {
                    (best, low) = (tried, middle + 1);
                }
                _ => high = middle,
            }
        }
        if best != row {
            self.rows[row].verdict = Verdict::Dearer;
        }
        for (i, other) in self.rows.iter_mut().enumerate() {
            if i != best && other.verdict == Verdict::GoodEnough {
                other.verdict = Verdict::Dearer;
            }
        }
        Ok(best)
    }

    /// The fewest frames after which the choice meets the target; where it never does, those that
    /// were asked for.
    fn settle(&mut self, chosen: usize, reached: bool) -> Result<(), FitError> {
        let candidate = self.rows[chosen].candidate.clone();
        let most = self.rows[chosen].frames;
        if !reached || most <= 1 {
            return Ok(());
        }
        let (mut low, mut high) = (0, most);
        // To an eighth: noise would make a finer answer.
        while high - low > (high / 8).max(1) {
            let middle = (low + high) / 2;
            let errors = self.errors(&candidate, middle.max(1))?.map(|(errors, _)| errors);
            let worst = errors.map_or(f64::NAN, |e| self.options.quality_target.worst(&e));
            let enough = self.options.quality_target.is_met(worst);
            self.rows[chosen].settling.push((middle.max(1), worst));
            if enough { high = middle } else { low = middle }
        }
        self.rows[chosen].frames = high;
        self.rows[chosen].settling.sort_by_key(|(frames, _)| *frames);
        Ok(())
    }

    /// The nearest to the target of those that were tried.
    fn nearest(&self) -> Option<usize> {
        let tried = self.rows.iter().enumerate().filter(|(_, r)| r.verdict == Verdict::TooFar);
        tried.min_by(|a, b| self.options.quality_target.order(a.1.worst, b.1.worst)).map(|(i, _)| i)
    }

    /// Tries a candidate in every view and adds its row; `None` where it is too dear or cannot draw
    /// the scene.
    fn attempt(&mut self, candidate: Candidate, frames: u32) -> Result<Option<usize>, FitError> {
        let cost_ms = match self.cost(&candidate)? {
            Some(cost) => cost,
            None => {
                let row = Row::blank(candidate, Verdict::Cannot);
                self.rows.push(row);
                return Ok(None);
            }
        };
        if self.options.budget_ms.is_some_and(|budget| cost_ms > budget) {
            let row = Row { cost_ms: Some(cost_ms), ..Row::blank(candidate, Verdict::TooDear) };
            self.rows.push(row);
            return Ok(None);
        }
        let frames = if candidate.method.has_history() { frames } else { 1 };
        let Some((errors, shots)) = self.errors(&candidate, frames)? else {
            let row = Row::blank(candidate, Verdict::Cannot);
            self.rows.push(row);
            return Ok(None);
        };
        let worst = self.options.quality_target.worst(&errors);
        let verdict = if self.options.quality_target.is_met(worst) { Verdict::GoodEnough } else { Verdict::TooFar };
        let bytes = shots.first().map_or(0, |s| s.bytes);
        let pictures = shots.iter().map(Frame::rgb).collect();
        let row =
            Row { errors, worst, cost_ms: Some(cost_ms), bytes, frames, pictures, ..Row::blank(candidate, verdict) };
        self.rows.push(row);
        Ok(Some(self.rows.len() - 1))
    }

    /// The metric in every view, and the pictures; `None` where another method drew in its place.
    fn errors(&mut self, candidate: &Candidate, frames: u32) -> Result<Option<Judged>, FitError> {
        let method = candidate.method(&self.options.networks);
        let settling = Settling { frames, samples: self.options.quality_target.samples() };
        let (mut errors, mut shots) = (Vec::new(), Vec::new());
        for view in 0..self.views.len() {
            self.tell(&format!("{} in view {view}, {frames} frames", candidate.name(&self.options.networks)));
            let shot = self.session.picture(&method, &self.views[view].camera, settling)?;
            if shot.fallback.is_some() {
                return Ok(None);
            }
            let error = self.options.quality_target.of(&shot, &self.views[view].reference);
            errors.push(error.map_err(|reason| FitError::Blind { view, reason })?);
            shots.push(shot);
        }
        Ok(Some((errors, shots)))
    }

    /// Milliseconds of its own passes in the first view; `None` where it cannot draw the scene.
    fn cost(&mut self, candidate: &Candidate) -> Result<Option<f64>, FitError> {
        if candidate.method == MethodName::Direct {
            return Ok(Some(0.0));
        }
        if let Some((_, known)) = self.costs.iter().find(|(r, _)| r == candidate) {
            return Ok(*known);
        }
        let cost = self.find_cost(candidate)?;
        self.costs.push((candidate.clone(), cost));
        Ok(cost)
    }

    fn find_cost(&mut self, candidate: &Candidate) -> Result<Option<f64>, FitError> {
        let method = candidate.method(&self.options.networks);
        let camera = self.views[0].camera.clone();
        if self.options.timed {
            let options = super::bench::BenchOptions { frames: 40, warmup: 20 };
            let measured = self.session.measure(&method, &camera, options, false)?;
            if measured.method != method.name() {
                return Ok(None);
            }
            if let Some(ms) = measured.own_ms() {
                return Ok(Some(ms));
            }
            // Without timestamps that can be believed: the clock, less that of the rasteriser
            // alone.
            let bare = self.session.measure(&bouncelight::gi::Method::Direct, &camera, options, false)?;
            return Ok(Some((measured.wall_ms.median - bare.wall_ms.median).max(0.0)));
        }
        match self.session.count(&method, &camera) {
            Ok(costs) => Ok(Some(modelled(&costs, &GTX_1050).ms)),
            Err(SessionError::Count(CountError::Fallback(_))) => Ok(None),
            Err(e) => Err(e.into()),
        }
    }
}
