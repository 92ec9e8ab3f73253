//! Times as text: a table to paste, and files for a spreadsheet.

use super::frames::{Group, Numbers, Times};
use super::rays;
use super::stats::Spread;
use bouncelight_lab::study::device::Device;
use std::fmt::Write as _;

/// One line of what is known: name, numbers, whether it is a part of the group above.
struct Line<'a> {
    group: &'a str,
    pass: &'a str,
    spread: Spread,
    /// Of the renderer's sum.
    share: Option<f64>,
}

/// Groups with their passes, in the order of the frame; the sums first.
fn lines(numbers: &Numbers) -> Vec<Line<'_>> {
    let mut lines = Vec::new();
    let mut add = |group, pass, spread: Option<Spread>, share| {
        lines.extend(spread.map(|spread| Line { group, pass, spread, share }));
    };
    let all = numbers.gpu.spread();
    let share = |s: Option<Spread>| Some(s?.median / all?.median.max(1e-9));
    add("GPU", "", all, None);
    add("CPU", "", numbers.cpu.spread(), None);
    add("frame", "waited for", numbers.wall.spread(), None);
    add("frame", "interval", numbers.interval.spread(), None);
    for group in Group::ALL {
        let sum = numbers.groups[group as usize].spread();
        let own = group == Group::Viewer;
        let mut rows = numbers.passes.iter().filter(|row| row.group == group).peekable();
        if rows.peek().is_some() {
            add(group.title(), "", sum, share(sum).filter(|_| !own));
        }
        for row in rows {
            let spread = row.track.spread();
            add(group.title(), &row.name, spread, share(spread).filter(|_| !own));
        }
    }
    lines
}

/// A Markdown table with what it is of above.
pub fn table(times: &Times, about: &Device) -> String {
    let [w, h] = times.run.size;
    let rays = times.now.rays.map_or(String::new(), |n| {
        format!(" · {} rays a frame ({})", rays::count(n as f64), rays::share(times.run.rays))
    });
    let mut text = format!(
        "{} · {} · {w}×{h}{}\n{} ({}, {}){}\n\n| | median ms | p95 ms | share | frames |\n|---|---|---|---|---|\n",
        times.run.method,
        times.run.scene,
        rays,
        about.adapter,
        about.backend,
        about.driver,
        if about.software { "; software rendering: times are not representative" } else { "" },
    );
    for Line { group, pass, spread, share } in lines(&times.now) {
        let name = if pass.is_empty() { format!("**{group}**") } else { pass.into() };
        let p95 = spread.p95.map_or("–".into(), |v| format!("{v:.3}"));
        let share = share.map_or(String::new(), |s| format!("{:.1} %", 100.0 * s));
        let _ = writeln!(text, "| {name} | {:.3} | {p95} | {share} | {} |", spread.median, spread.count);
    }
    text
}

/// A field of a CSV file.
fn field(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.into() }
}

/// Passes with what they were measured on in every row, so that files can be joined.
pub fn passes_csv(times: &Times, about: &Device) -> String {
    let mut text = "adapter,backend,driver,software,scene,method,width,height,group,pass,median_ms,p95_ms,mean_ms,\
        share,frames,rays,ray_share\n"
        .to_string();
    let [w, h] = times.run.size;
    let words = [&about.adapter, &about.backend, &about.driver].map(|t| field(t)).join(",");
    let of = format!("{words},{},{},{},{w},{h}", about.software, field(&times.run.scene), field(&times.run.method));
    // A count is no share.
    let rays = times.now.rays.map_or(",".into(), |n| {
        let share = if times.run.rays > 1.0 { String::new() } else { times.run.rays.to_string() };
        format!("{n},{share}")
    });
    for Line { group, pass, spread, share } in lines(&times.now) {
        let number = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.4}"));
        let Spread { median, p95, mean, count } = spread;
        let (group, pass, p95, share) = (field(group), field(pass), number(p95), number(share));
        let _ = writeln!(text, "{of},{group},{pass},{median:.4},{p95},{mean:.4},{share},{count},{rays}");
    }
    text
}

/// The graph's frames, oldest first.
pub fn frames_csv(times: &Times) -> String {
    let mut text = "frame,scene,method,width,height,gpu_ms,cpu_ms,waited_ms".to_string();
    for group in Group::ALL {
        let _ = write!(text, ",{}_ms", group.title().to_lowercase().replace([' ', '-'], "_"));
    }
    text.push('\n');
    for (i, frame) in times.history.iter().enumerate() {
        let [w, h] = frame.run.size;
        let gpu: f32 = frame.groups[..Group::Viewer as usize].iter().sum();
        let of = format!("{i},{},{},{w},{h}", field(&frame.run.scene), field(&frame.run.method));
        let _ = write!(text, "{of},{gpu:.4},{:.4},{:.4}", frame.cpu, frame.whole);
        frame.groups.iter().for_each(|ms| {
            let _ = write!(text, ",{ms:.4}");
        });
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::frames::Run;
    use std::time::Instant;

    #[test]
    fn records_name_what_they_are_of_and_add_up() {
        let mut times = Times::default();
        times.begin(Run { method: "SSGI".into(), scene: "a, b.glb".into(), size: [640, 360], rays: 0.5 });
        let run = times.run.clone();
        for _ in 0..20 {
            let passes = [("gbuffer", 1.0), ("gi.ssgi", 3.0), ("viewer.show", 9.0)].map(|(l, ms)| (l.to_string(), ms));
            times.frame(Instant::now(), &passes, 0.5, &run);
        }
        let about = Device { adapter: "A \"7\"".into(), backend: "vulkan".into(), driver: "d".into(), software: true };
        assert!(!table(&times, &about).contains("rays"), "nobody has counted any");
        times.now.rays = Some(41_234);
        let table = table(&times, &about);
        assert!(table.contains("a, b.glb · 640×360 · 41 k rays a frame (1/2)\n"), "{table}");
        assert!(table.contains("640×360") && table.contains("not representative"), "{table}");
        assert!(table.contains("| **GPU** | 4.000 | 4.000 |  | 20 |"), "{table}");
        assert!(table.contains("| gi.ssgi | 3.000 | 3.000 | 75.0 % | 20 |"), "{table}");
        let csv = passes_csv(&times, &about);
        let rows: Vec<&str> = csv.lines().collect();
        assert!(rows[1].starts_with("\"A \"\"7\"\"\",vulkan,d,true,\"a, b.glb\",SSGI,640,360,GPU,,4.0000"), "{csv}");
        assert!(rows[0].ends_with(",frames,rays,ray_share") && rows[1].ends_with(",20,41234,0.5"), "{csv}");
        // Every row has as many fields as the head, quoted commas apart.
        assert!(rows.iter().skip(1).all(|r| r.matches(',').count() == rows[0].matches(',').count() + 1), "{csv}");
        let frames = frames_csv(&times);
        assert_eq!(frames.lines().count(), 21);
        assert!(
            frames.lines().next().unwrap().ends_with("g_buffer_ms,direct_light_ms,gi_ms,network_ms,post_ms,viewer_ms")
        );
    }
}
