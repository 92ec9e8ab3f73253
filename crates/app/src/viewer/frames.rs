//! What frames took: by pass, by group of passes, and one after the other.

use super::stats::Track;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;

/// Frames that the graph remembers.
pub const HISTORY: usize = 300;

/// What passes are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    Gbuffer = 0,
    Direct = 1,
    Gi = 2,
    Network = 3,
    Post = 4,
    /// The window's own passes, which no renderer has.
    Viewer = 5,
}

impl Group {
    /// In the order of the frame.
    pub const ALL: [Group; 6] = [Group::Gbuffer, Group::Direct, Group::Gi, Group::Network, Group::Post, Group::Viewer];

    /// What the window calls it.
    pub fn title(self) -> &'static str {
        ["G-buffer", "Direct light", "GI", "Network", "Post", "Viewer"][self as usize]
    }

    /// Where the pass called `label` belongs.
    pub fn of(label: &str) -> Self {
        match label {
            "deform" | "gbuffer" => Group::Gbuffer,
            "shadow" | "lights" | "direct" => Group::Direct,
            "gi.features" | "pictures" | "paint" => Group::Network,
            label if label.starts_with("net.") => Group::Network,
            label if label.starts_with("gi.") || label == "indirect" => Group::Gi,
            label if label.starts_with("viewer.") => Group::Viewer,
            _ => Group::Post,
        }
    }
}

/// What a pass does, for those who see its name only; nothing where the name says it.
pub fn doc(label: &str) -> &'static str {
    match label {
        "deform" => "skins and morphs vertices",
        "gbuffer" => "draws depth, normals, albedo, specular and emission",
        "shadow" => "draws shadow maps that have changed",
        "lights" => "sorts lights into tiles of the picture",
        "direct" => "analytic lights, with shadows",
        "indirect" => "reflections and indirect light of surfaces that blend",
        "composite" => "albedo times light, reflections and emission: the picture",
        "blended" => "surfaces that blend, over the picture",
        "taa" => "temporal anti-aliasing",
        "gi.ambient" | "gi.occlusion" | "gi.occlusion_full" => "constant light times ambient occlusion",
        "gi.ssgi" | "gi.ssgi_full" => "one bounce of light found on the screen",
        "gi.radiance" => "outgoing radiance at lower resolutions",
        "gi.color_pyramid" => "the lit picture at lower resolutions (colour pyramid), for reflections",
        "gi.ssr" => "screen-space reflections",
        "gi.exposure" => "mean light of the picture",
        "gi.downsample" => "chooses the pixel that represents each cell",
        "gi.reproject" => "finds each cell's history in the last frame (reprojection)",
        "gi.trace" => "traces rays of cells into the scene's triangles",
        "gi.specular_trace" => "traces specular rays of smooth pixels",
        "gi.gradient" => "traces old rays again where light has changed (temporal gradient)",
        "gi.accumulate" => "temporal accumulation of each cell's rays",
        "gi.blur" | "gi.atrous" => "blurs cells over neighbours on the same surface",
        "gi.upsample" => "upsamples cells to pixels (joint bilateral)",
        "gi.cache_update" => "updates the radiance cache",
        "gi.cache_select" => "finds entries of the radiance cache that are due",
        "gi.cache_evict" => "frees old entries of the radiance cache",
        "gi.features" | "pictures" => "inputs of the network",
        "paint" => "shows what the network has painted",
        "viewer.show" => "draws the picture into the window",
        "viewer.sum" => "accumulates frames of a still view",
        "viewer.overlay" => "draws panel and overlay",
        _ => "",
    }
}

/// A layer of the network; there are dozens of them.
pub fn is_layer(label: &str) -> bool {
    label.starts_with("net.")
}

/// A pass that takes time.
#[derive(Debug, Clone)]
pub struct Row {
    pub name: String,
    pub group: Group,
    pub track: Track,
}

/// A frame of the graph.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// GPU milliseconds by group; none without timestamps.
    pub groups: [f32; 6],
    /// Recording until the device was idle, where there are no timestamps.
    pub whole: f32,
    pub cpu: f32,
    /// What it was drawn with.
    pub run: Arc<Run>,
}

impl Frame {
    /// Milliseconds of the renderer, the window's own passes apart.
    pub fn renderer(&self) -> f32 {
        self.groups[..Group::Viewer as usize].iter().sum::<f32>() + self.whole
    }
}

/// What frames were drawn with; numbers of two runs are never mixed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Run {
    /// Name of the method, or of both.
    pub method: String,
    pub scene: String,
    pub size: [u32; 2],
    /// Rays that were asked for, as `gather::Options::rays` has them; 1 without any.
    pub rays: f32,
}

/// Numbers of one run.
#[derive(Debug, Clone, Default)]
pub struct Numbers {
    /// GPU time of each pass in the order of the frame, the window's own among them.
    pub passes: Vec<Row>,
    pub groups: [Track; 6],
    /// Sum of the renderer's passes.
    pub gpu: Track,
    /// From before recording to after submission.
    pub cpu: Track,
    /// Recording until the device is idle, where there are no timestamps.
    pub wall: Track,
    /// From one frame to the next, while frames follow each other.
    pub interval: Track,
    /// Rays that a frame has sent lately, those of both sides; none by methods without any.
    pub rays: Option<u64>,
}

/// All that is measured.
#[derive(Debug, Default)]
pub struct Times {
    /// Of what is drawn now.
    pub now: Numbers,
    /// The overlay's own share of CPU time: layout, tessellation, upload.
    pub overlay: Track,
    /// Oldest first.
    pub history: VecDeque<Frame>,
    /// What frames are drawn with now.
    pub run: Arc<Run>,
    /// Numbers of what was drawn before; it goes on where it comes back, as half the resolution
    /// does with every move.
    past: Vec<(Arc<Run>, Numbers)>,
}

/// Runs that are remembered.
const PAST: usize = 12;

impl Times {
    /// Frames are drawn with something else from now on; its numbers go on where they were, and the
    /// history in any case.
    pub fn begin(&mut self, run: Run) {
        if *self.run == run {
            return;
        }
        let (run, numbers) = match self.past.iter().position(|(past, _)| **past == run) {
            Some(at) => self.past.remove(at),
            None => (Arc::new(run), Numbers::default()),
        };
        let before = (std::mem::replace(&mut self.run, run), std::mem::replace(&mut self.now, numbers));
        self.past.push(before);
        if self.past.len() > PAST {
            self.past.remove(0);
        }
    }

    /// Numbers of what is drawn begin anew, as those of a renderer that was just built.
    pub fn forget(&mut self) {
        self.now = Numbers::default();
    }

    /// Takes a frame's passes in; those with one label are added up. Frames of an older run only go
    /// into the history.
    pub fn frame(&mut self, now: Instant, passes: &[(String, f64)], cpu: f64, run: &Arc<Run>) {
        let mut order: Vec<(&str, f64)> = Vec::new();
        for (label, ms) in passes {
            match order.iter_mut().find(|(l, _)| l == label) {
                Some(row) => row.1 += ms,
                None => order.push((label, *ms)),
            }
        }
        let mut groups = [0.0; 6];
        order.iter().for_each(|(label, ms)| groups[Group::of(label) as usize] += ms);
        self.remember(Frame { groups: groups.map(|ms| ms as f32), whole: 0.0, cpu: cpu as f32, run: run.clone() });
        if !Arc::ptr_eq(run, &self.run) {
            return;
        }
        // Rows of passes that are not drawn any more go.
        self.now.passes.retain(|row| order.iter().any(|(l, _)| *l == row.name));
        for (i, (label, ms)) in order.iter().enumerate() {
            let at = match self.now.passes.iter().position(|row| row.name == *label) {
                Some(at) => at,
                None => {
                    let at = i.min(self.now.passes.len());
                    let row = Row { name: (*label).into(), group: Group::of(label), track: Track::default() };
                    self.now.passes.insert(at, row);
                    at
                }
            };
            self.now.passes[at].track.add(now, *ms);
        }
        self.now.groups.iter_mut().zip(groups).for_each(|(track, ms)| track.add(now, ms));
        self.now.gpu.add(now, groups[..Group::Viewer as usize].iter().sum());
    }

    /// A frame that the clock has measured.
    pub fn waited(&mut self, now: Instant, ms: f64, cpu: f64) {
        let run = self.run.clone();
        self.remember(Frame { groups: [0.0; 6], whole: ms as f32, cpu: cpu as f32, run });
        self.now.wall.add(now, ms);
    }

    fn remember(&mut self, frame: Frame) {
        self.history.push_back(frame);
        if self.history.len() > HISTORY {
            self.history.pop_front();
        }
    }

    /// Name of the slowest of the renderer's passes; a network counts as its layers.
    pub fn slowest(&self) -> Option<&str> {
        let ms = |row: &&Row| row.track.median().unwrap_or(0.0);
        let rows = self.now.passes.iter().filter(|row| row.group != Group::Viewer);
        rows.max_by(|a, b| ms(a).total_cmp(&ms(b))).map(|row| row.name.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(label: &str, ms: f64) -> (String, f64) {
        (label.to_string(), ms)
    }

    fn run(method: &str) -> Run {
        Run { method: method.into(), scene: "cornell".into(), size: [4, 4], rays: 1.0 }
    }

    #[test]
    fn passes_are_added_up_and_old_ones_go() {
        let (mut times, now) = (Times::default(), Instant::now());
        times.begin(run("a"));
        let own = times.run.clone();
        let rows = [row("shadow", 1.0), row("shadow", 2.0), row("net.a", 3.5), row("composite", 1.0)];
        times.frame(now, &rows, 0.5, &own);
        assert_eq!(times.now.passes[0].track.spread().unwrap().median, 3.0);
        assert_eq!(times.slowest(), Some("net.a"));
        times.frame(now, &[row("shadow", 1.0), row("gi.ambient", 3.0), row("composite", 1.0)], 0.5, &own);
        let names: Vec<_> = times.now.passes.iter().map(|r| r.name.as_str()).collect();
        assert_eq!(names, ["shadow", "gi.ambient", "composite"]);
        assert_eq!(times.now.gpu.spread().unwrap().count, 2);
    }

    #[test]
    fn the_windows_own_passes_stand_apart() {
        let (mut times, now) = (Times::default(), Instant::now());
        let own = times.run.clone();
        times.frame(now, &[row("gbuffer", 1.0), row("direct", 2.0), row("viewer.show", 40.0)], 0.5, &own);
        assert_eq!(times.now.gpu.median(), Some(3.0));
        assert_eq!(times.now.groups[Group::Viewer as usize].median(), Some(40.0));
        assert_eq!((times.history[0].renderer(), times.slowest()), (3.0, Some("direct")));
    }

    #[test]
    fn the_history_goes_over_a_change_of_method_and_numbers_do_not() {
        let (mut times, now) = (Times::default(), Instant::now());
        times.begin(run("a"));
        let a = times.run.clone();
        (0..3).for_each(|_| times.frame(now, &[row("direct", 9.0)], 0.5, &a));
        times.begin(run("b"));
        let b = times.run.clone();
        times.begin(run("b"));
        // One of the old method's is late.
        times.frame(now, &[row("direct", 9.0)], 0.5, &a);
        times.frame(now, &[row("direct", 2.0)], 0.5, &b);
        assert_eq!(times.now.gpu.spread().unwrap().count, 1);
        assert_eq!(times.now.gpu.median(), Some(2.0));
        let runs: Vec<_> = times.history.iter().map(|f| f.run.method.as_str()).collect();
        assert_eq!(runs, ["a", "a", "a", "a", "b"]);
        times.begin(run("a"));
        assert_eq!(times.now.gpu.spread().unwrap().count, 3, "what comes back goes on");
    }

    #[test]
    fn every_label_of_a_frame_has_its_group() {
        use Group as G;
        let of = |labels: [&str; 3]| labels.map(Group::of);
        assert_eq!(of(["deform", "gbuffer", "shadow"]), [G::Gbuffer, G::Gbuffer, G::Direct]);
        assert_eq!(of(["gi.trace", "indirect", "gi.features"]), [G::Gi, G::Gi, G::Network]);
        assert_eq!(of(["net.out", "tonemap", "viewer.sum"]), [G::Network, G::Post, G::Viewer]);
        assert_eq!(of(["pictures", "paint", "composite"]), [G::Network, G::Network, G::Post]);
    }
}
