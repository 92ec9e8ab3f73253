//! What is built is brought in line with what is chosen.

use super::App;
use crate::viewer::choice::Source;
use crate::viewer::jobs::{self, Key, Kind, Plan};
use std::time::Instant;

impl App {
    /// What decides how a source is built.
    pub(super) fn key(&self, source: Source) -> Key {
        let [weights, shaders, numbers] = self.stamps;
        let own = match source {
            source if source.needs_weights() => weights,
            source if source.gathers() || source.has_ambient_term() => numbers,
            _ => 0,
        };
        (source, shaders << 32 | own)
    }

    /// Brings what is built in line with what is chosen, and the path tracer with what is seen.
    pub fn reconcile(&mut self) {
        self.reconcile_renderers();
        self.reconcile_reference();
        if self.tracing.judge_at.is_some_and(|at| at <= Instant::now()) {
            self.tracing.judge_at = None;
            self.judge();
        }
    }

    pub(super) fn reconcile_renderers(&mut self) {
        let (Some(stage), Some(_)) = (&mut self.stage, &self.state.shown) else { return };
        let s = &self.state.settings;
        let left = match s.left {
            // Somebody has to draw the G-buffer.
            Source::Reference => stage.key(0).map_or(Source::Direct, |k| k.0),
            source => source,
        };
        let two = self.state.sources().len() == 2 && s.right != s.left && s.right != Source::Reference;
        if !two {
            stage.drop_right();
            self.building[1] = None;
        }
        let wanted = [Some(left), two.then_some(s.right)];
        let by_name = wanted.into_iter().flatten().any(Source::needs_rays) && stage.wants_rays();
        if by_name || stage.lacks_rays() {
            self.reconcile_rays();
        }
        for (side, source) in wanted.into_iter().enumerate() {
            let Some(key) = source.map(|s| self.key(s)) else { continue };
            let Some(stage) = &self.stage else { return };
            if stage.key(side) == Some(key) {
                self.building[side] = None;
                continue;
            }
            if self.building[side] == Some(key) || self.failed.contains(&key) {
                continue;
            }
            self.building[side] = Some(key);
            let plan = Plan {
                side,
                key,
                size: self.state.size,
                weights: self.state.settings.weights.clone(),
                network: self.network.clone(),
            };
            let handles = stage.handles();
            let name = format!("build {}", key.0.name());
            self.spawn(name, Kind::Renderer(side), move |p| jobs::renderer(&handles, plan, p));
        }
    }

    /// True while a method on show waits for trees that nobody has begun to build.
    #[cfg(feature = "script")]
    pub(super) fn will_build_rays(&self) -> bool {
        let Some(stage) = &self.stage else { return false };
        let sources = self.state.sources();
        let wanted = (sources.iter().any(|s| s.needs_rays()) && stage.wants_rays()) || stage.lacks_rays();
        wanted && self.rays_of != Some(self.uploads)
    }

    /// Begins to build the trees of the scene on show, unless somebody is at it.
    fn reconcile_rays(&mut self) {
        let stamp = self.uploads;
        let (Some(stage), Some(shown)) = (&self.stage, &self.state.shown) else { return };
        if self.rays_of == Some(stamp) {
            return;
        }
        self.rays_of = Some(stamp);
        let (handles, scene) = (stage.handles(), shown.scene.clone());
        self.spawn("building BVH".into(), Kind::Rays, move |p| jobs::rays(&handles, stamp, &scene, p));
    }

    /// A source that cannot be had: the side keeps what it has.
    pub(super) fn give_up(&mut self, side: usize, key: Key) {
        let kept = self.stage.as_ref().and_then(|s| s.key(side)).map_or(Source::Direct, |k| k.0);
        let place = if side == 0 { &mut self.state.settings.left } else { &mut self.state.settings.right };
        if *place == key.0 && kept != key.0 {
            *place = kept;
        }
    }
}
