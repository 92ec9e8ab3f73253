//! How things stand, as JSON: what scripts ask.

use super::app::App;
use super::choice::Side;
use super::film::Film;
use serde_json::{Value, json};

/// Everything that a script can expect.
pub fn report(app: &App) -> Value {
    let (s, n) = (&app.state.settings, &app.state.navigator);
    let stage = app.stage.as_ref();
    let by = |side: Side| stage.and_then(|st| st.drawn_by(&app.state, side));
    let key = |side: Side| by(side).filter(|_| app.state.sources().len() > side as usize).map(|by| by.source.name());
    let shown = app.state.shown.as_ref();
    let scene = shown.map(|shown| {
        let lights: Vec<_> = shown
            .scene
            .lights
            .iter()
            .enumerate()
            .map(|(i, l)| bouncelight_scene::edit::LightEdit::of(i, l).to_string())
            .collect();
        json!({
            "spec": shown.spec, "objects": shown.scene.instances.len(), "lights": lights,
            "environment": shown.environment, "added": shown.added,
            "sky": shown.scene.environment.radiance, "moved": shown.moved.len(),
            "variant": shown.variant, "variants": shown.scene.variants, "pose": shown.pose,
            "playing": app.state.animated.is_some(),
            "animations": shown.scene.rig.as_ref().map_or(0, |r| r.animations.len()),
        })
    });
    let found = stage.and_then(|st| st.reference());
    let memory: std::collections::BTreeMap<String, u64> = app.meter.memory.iter().cloned().collect();
    let passes: Vec<_> = app.meter.times.now.passes.iter().map(|r| r.name.clone()).collect();
    let mut report = json!({
        "loaded": shown.is_some() && stage.is_some_and(|st| st.has_scene() && st.still() > 0),
        "idle": app.is_idle(), "version": app.state.version,
        "frames": app.frames, "layouts": app.overlay.layouts, "built": app.built, "places": app.overlay.memory.places, "status": app.overlay.memory.status,
        "density_drawn": app.overlay.density, "scene_frames": app.scene_frames,
        "view": s.view.name(), "left": s.left.name(), "right": s.right.name(), "split": s.split, "line": s.line,
        "fallback": by(Side::Left).and_then(|by| Some(format!("{}: {}", by.source.name(), by.why?))),
        "drawn": { "left": key(Side::Left), "right": key(Side::Right) },
        "backdrop": s.backdrop.name(), "coarse": app.state.is_coarse(), "exposure": app.state.stops(), "auto_exposure": app.state.auto_exposure, "tonemap": s.tonemap.name(), "samples": s.samples, "rays": s.rays,
        "still": stage.map_or(0, |st| st.still()),
        "full_screen": app.state.full_screen, "panel": s.panel, "help": app.state.help, "dark": s.dark, "zoom": s.zoom, "measure": app.state.measure,
        "feature": stage.and_then(|st| st.feature()).map(|f| f.0.to_string()),
    });
    let world = json!({
        "camera": {
            "eye": n.eye.to_array(), "target": n.target.to_array(), "fov": n.fov, "fly": n.fly, "speed": n.speed,
            "file": n.file_camera,
        },
        "path": {
            "keys": app.state.path.as_ref().map_or(0, |p| p.keys.len()),
            "recording": matches!(app.state.film, Film::Records(_)),
            "playing": matches!(app.state.film, Film::Plays { .. }),
        },
        "selected": app.state.selected, "scene": scene, "weights": s.weights, "recent": s.recent,
        "size": app.state.size, "window": app.screen.as_ref().map(|sc| sc.size()),
        "density": app.screen.as_ref().map(|sc| sc.window.scale_factor()),
        "messages": app.state.messages.iter().map(|m| m.text.clone()).collect::<Vec<_>>(),
        "errors": app.state.messages.iter().filter(|m| m.error).count(),
        "jobs": app.jobs.iter().map(|j| j.name.clone()).collect::<Vec<_>>(),
        "copied": app.copied, "captured": app.captured, "rebuilt": app.rebuilt,
        "software": stage.map(|st| st.gpu.is_software()),
    });
    let times = &app.meter.times;
    let (timing, history) = (&s.timing, &times.history);
    let changes = history.iter().zip(history.iter().skip(1)).filter(|(a, b)| a.run != b.run).count();
    let count = times.now.gpu.spread().or(times.now.wall.spread()).map_or(0, |s| s.count);
    let window = json!({
        "timing": {
            "shown": timing.shown, "expanded": timing.expanded, "at": timing.at, "unfolded": timing.unfolded,
            "history": history.len(), "runs": changes + usize::from(!history.is_empty()), "count": count,
            "method": times.run.method, "rays": times.now.rays,
        },
        "touring": app.touring().is_some(), "resident": app.meter.resident, "greeted": s.greeted,
        "undo": app.state.history.len(), "panel_width": s.panel_width,
        "sky_added": shown.is_some_and(|s| s.sky_added),
    });
    let v = app.tracing.verdict.as_ref();
    let measured = json!({
        "reference": {
            "samples": found.map_or(0, |f| f.samples), "finished": found.is_some_and(|f| f.finished),
            "noise": found.map(|f| f.noise), "texel": found.map(|f| f.texel), "denoised": found.is_some_and(|f| f.denoised.is_some()),
        },
        "verdict": v.map(|v| json!({ "by": v.by.map(|by| by.name()), "psnr": v.psnr, "ssim": v.ssim, "mae": v.mae, "relmse": v.rel_mse,
            "bias": v.bias, "noisy": v.is_noise(app.tracing.facts.and_then(|f| f.noise).unwrap_or(0.0)) })),
        "flicker": app.meter.flicker, "passes": passes, "memory": memory,
        "gpu_ms": app.meter.times.now.gpu.median(),
        "cpu_ms": app.meter.times.now.cpu.median(),
        "overlay_ms": app.meter.times.overlay.spread().map(|t| t.mean),
        "overlay": app.meter.times.overlay.spread().map(|t| json!({ "median": t.median, "p95": t.p95,
            "count": t.count })),
    });
    for part in [world, measured, window] {
        if let (Some(all), Value::Object(part)) = (report.as_object_mut(), part) {
            all.extend(part);
        }
    }
    report
}
