//! What was found, in words: CSV for programs, Markdown for people.

use super::{
    Kind, Metric, Record, Scores, Time,
    published::{PRINTED_L1, PRINTED_MS},
    run::missing,
    summary::{Bars, Clock, Row, rows},
};
use crate::study::{
    bench::AGREEMENT,
    projection::{GTX_1050, model, modelled},
    wrap::wrapped,
};
use std::fmt::Write;

/// A line for each entry, scene and state, with everything that tells where it comes from.
pub fn csv(record: &Record) -> String {
    let mut text = String::from(
        "schema,entry,kind,weights,scene,scene_hash,width,height,state,light,light_bias,flip,l1_per_1024x512,psnr,relmse,\
         gpu_ms_median,gpu_ms_p95,wall_ms_median,wall_ms_p95,gflop,mb,rays,gpu_bytes,projected_gtx1050_ms,adapter,driver,commit,\
         program,failed\n",
    );
    for unit in &record.units {
        let entry = record.entries.iter().find(|e| e.name == unit.entry);
        let scene = record.scenes.iter().find(|s| s.name == unit.scene);
        let (kind, weights) = entry.map_or(("", ""), |e| (kind(e.kind), e.weights.as_deref().unwrap_or("")));
        let size = scene.map_or(record.size, |s| s.size);
        let sum = |f: fn(&crate::study::projection::Cost) -> f64| unit.costs.iter().map(f).sum::<f64>();
        let states: [(&str, &Option<Scores>, &Option<Time>); 2] =
            [("settled", &unit.scores, &unit.time), ("cold", &unit.cold, &unit.cold_time)];
        for (state, scores, time) in states {
            if state == "cold" && scores.is_none() {
                continue;
            }
            let score = |f: &dyn Fn(&Scores) -> Option<f64>| scores.as_ref().and_then(f);
            let gpu = time.as_ref().and_then(|t| t.gpu_ms);
            let wall = time.as_ref().map(|t| t.wall_ms);
            let whole = unit.costs.iter().all(|c| c.has_threads());
            let projected =
                (whole && entry.map(|e| e.kind) != Some(Kind::Paths)).then(|| modelled(&unit.costs, &GTX_1050).ms);
            let numbers = [
                score(&|s| s.light),
                score(&|s| s.light_bias),
                score(&|s| Some(s.flip)),
                score(&|s| Some(s.l1)),
                score(&|s| s.psnr),
                score(&|s| s.relmse),
                gpu.map(|g| g.median),
                gpu.map(|g| g.p95),
                wall.map(|w| w.median),
                wall.map(|w| w.p95),
                Some(sum(|c| c.flops) / 1e9),
                Some(sum(|c| c.bytes) / 1e6),
                Some(sum(|c| c.rays)),
                Some(unit.bytes as f64),
                projected,
            ];
            let numbers: Vec<String> =
                numbers.iter().map(|n| n.map_or(String::new(), |v| (v + 0.0).to_string())).collect();
            let [w, h] = size;
            let words =
                [unit.entry.as_str(), kind, weights, &unit.scene, scene.map_or("", |s| s.hash.as_str())].map(quoted);
            let p = &record.provenance;
            let failed = unit.failed.as_deref().unwrap_or("");
            let from =
                [record.device.adapter.as_str(), &record.device.driver, &p.commit, &p.program, failed].map(quoted);
            let [entry, kind, weights, scene, hash] = words;
            let (numbers, from) = (numbers.join(","), from.join(","));
            let _ = writeln!(text, "1,{entry},{kind},{weights},{scene},{hash},{w},{h},{state},{numbers},{from}");
        }
    }
    text
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

fn kind(kind: Kind) -> &'static str {
    match kind {
        Kind::Method => "method",
        Kind::Pictures => "network on pictures",
        Kind::Paths => "paths",
    }
}

/// The table on a terminal.
pub fn table(record: &Record, metric: Metric) -> String {
    let mut text = String::new();
    let heads = ["error", "cold", "ms", "clock ms", "1050 ms*", "GFLOP", "MB", "Mray"];
    let heads: String = heads.iter().map(|h| format!("{h:>11}")).collect();
    let _ = writeln!(text, "{:<30}{heads}  frontier", "");
    for row in rows(record, metric) {
        let error = |b: Option<Bars>| b.map_or(String::new(), |b| metric.text(b.mean));
        let ms = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.2}"));
        let cells = [
            error(row.error),
            error(row.cold),
            ms(row.ms.map(|b| b.mean)),
            ms(row.wall_ms),
            ms(row.projected_ms),
            format!("{:.3}", row.gflop),
            format!("{:.1}", row.mb),
            format!("{:.3}", row.rays / 1e6),
        ];
        let cells: String = cells.iter().map(|c| format!("{c:>11}")).collect();
        let _ = writeln!(text, "{:<30}{cells}  {}", row.name, standing(&row));
    }
    let _ = writeln!(
        text,
        "* modelled for a {}, of what finds and adds indirect light; never measured: {} times it to {} times it",
        GTX_1050.name,
        model().spread[0],
        model().spread[1]
    );
    text
}

/// Whether it is on a frontier, or cannot be compared.
fn standing(row: &Row) -> String {
    let mut words = Vec::new();
    match (row.kind, row.whole) {
        (Kind::Pictures, _) if row.scenes == 0 => words.push("this metric does not judge it".into()),
        (_, false) => words.push(format!("judged in {} scenes only", row.scenes)),
        (Kind::Paths, _) => {}
        _ => {
            words.extend(row.best.then(|| "measured".to_owned()));
            words.extend(row.best_projected.then(|| "modelled".to_owned()));
        }
    }
    words.join(", ")
}

/// The page: `picture` is the chart's path as the page names it.
pub fn page(record: &Record, metric: Metric, picture: &str) -> String {
    let mut text = String::new();
    let p = &record.provenance;
    let [w, h] = record.size;
    let add = |text: &mut String, line: &str| {
        text.push_str(line);
        text.push('\n');
    };
    add(&mut text, "# Results\n");
    add(&mut text, "Made by one command, not by hand; changes are lost. `training/chart.py` draws the picture.\n");
    add(&mut text, &format!("    {}\n", p.command));
    add(
        &mut text,
        &format!("Device: **{}**. Commit {}, program {}, {}.\n", record.device.sentence(), p.commit, p.program, p.date),
    );
    if record.device.software {
        let cpu = "These times are a CPU driver's and say nothing of a GPU beyond ratios of like work; the column for a GTX 1050 is modelled from counts, which nobody has measured.";
        add(&mut text, &format!("{cpu}\n"));
    }
    add(&mut text, &format!("![error against time]({picture})\n"));
    add(&mut text, &format!("## {} at {w}×{h}\n", title(metric)));
    add(&mut text, &how(record, metric));
    add(&mut text, &main_table(record, metric));
    add(&mut text, &frontiers(record, metric));
    add(&mut text, &generator(record));
    for other in Metric::ALL.into_iter().filter(|m| *m != metric) {
        add(&mut text, &format!("## {} of the same pictures\n", title(other)));
        add(&mut text, &by_scene(record, other));
    }
    add(&mut text, &format!("## {} by scene\n", title(metric)));
    add(&mut text, &by_scene(record, metric));
    add(&mut text, "## References\n");
    add(&mut text, &references(record));
    let missing = missing(record, metric);
    if !missing.is_empty() {
        add(&mut text, "## What is missing\n");
        missing.iter().for_each(|line| add(&mut text, &format!("- {line}")));
    }
    format!("{}\n", wrapped(&text).trim_end())
}

fn title(metric: Metric) -> &'static str {
    ["Error of the light that is added", "FLIP", "The paper's L1"][metric as usize]
}

fn how(record: &Record, metric: Metric) -> String {
    let [frames, warmup] = record.frames;
    let what = match metric {
        Metric::Light => {
            "Error: Σ|ours − reference| / Σ reference of the diffuse light that a method has to add (E/π), after \
             pooling over 4×4 \
             pixels, on surfaces with albedo above 0.01 and light above 2 % of the median (docs/results/accuracy.md)."
        }
        Metric::Flip => "Error: FLIP of the finished picture through Filmic, in 8 bits.",
        Metric::L1 => "Error: the paper's L1 (each channel stretched on its own), scaled to the pixels of 1024×512.",
    };
    // Records of older programs have no waiting in their counts.
    let waits = record.units.iter().flat_map(|u| &u.costs).any(|c| c.waited > 0.0);
    let waiting = if waits { ", with what threads wait for each other in the last of the settled frames" } else { "" };
    format!(
        "{what} Means over {} scenes, in brackets best and worst. Settled pictures are of the 32nd frame of a still \
         camera on, {} samples \
         a pixel; the first frame has one. Time: a whole frame, rasteriser included, median of {frames} frames after \
         {warmup}; {}. \
         Counted (GFLOP, MB, rays) and modelled{waiting}: only the passes that find and add indirect light. \
         \"Against paths\": how many times as long our path tracer takes to come as near on this device.{}\n",
        record.sound_scenes(),
        record.samples,
        match Clock::of(record) {
            Clock::Gpu => "by timestamps, with the synchronised clock beside them".to_owned(),
            Clock::Wall => format!(
                "by the synchronised clock, since timestamps are more than {:.0} % away from it on this device or are \
                 not there",
                AGREEMENT * 100.0
            ),
        },
        if record.no_caustics {
            " What gloss throws on after a diffuse bounce is left out of references, paths and methods alike \
             (`--no-caustics`), as \
             Cycles' references leave it out."
        } else {
            ""
        }
    )
}

fn main_table(record: &Record, metric: Metric) -> String {
    let mut text = format!(
        "| | error, settled | first frame | frame, ms | clock, ms | GFLOP | MB | Mray | GPU memory, MiB | {} ms, \
         **modelled** | against paths |\n|{}\n",
        GTX_1050.name,
        "---|".repeat(11)
    );
    for row in rows(record, metric) {
        let bars = |b: Option<Bars>| {
            b.map_or(String::new(), |b| {
                format!("{} ({} to {})", metric.text(b.mean), metric.text(b.low), metric.text(b.high))
            })
        };
        let ms = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.2}"));
        let name = match (row.best, row.best_projected) {
            (true, _) => format!("**{}**", row.name),
            _ => row.name.clone(),
        };
        let name = if row.whole || row.scenes == 0 { name } else { format!("{name} (in {} scenes)", row.scenes) };
        let counted = row.kind != Kind::Paths;
        let count = |v: f64, digits: usize| if counted { format!("{v:.digits$}") } else { String::new() };
        let against = row
            .against_paths
            .map_or(String::new(), |(times, beyond)| format!("{}{times:.1}×", if beyond { "about " } else { "" }));
        let cells = [
            name,
            bars(row.error),
            bars(row.cold),
            ms(row.ms.map(|b| b.mean)),
            ms(row.wall_ms),
            count(row.gflop, 3),
            count(row.mb, 1),
            format!("{:.3}", row.rays / 1e6),
            if row.bytes > 0 { format!("{:.0}", row.bytes as f64 / 1_048_576.0) } else { String::new() },
            ms(row.projected_ms),
            against,
        ];
        let _ = writeln!(text, "| {} |", cells.join(" | "));
    }
    text.push_str(
        "\nBold: nothing that is drawn in a frame is faster and nearer. Of paths, \"Mray\" counts the paths. \"About\": beyond the paths that were traced, by their square root.\n",
    );
    text
}

fn frontiers(record: &Record, metric: Metric) -> String {
    let rows = rows(record, metric);
    let list = |best: fn(&Row) -> bool, time: fn(&Row) -> Option<f64>| {
        let mut on: Vec<&Row> = rows.iter().filter(|r| best(r)).collect();
        on.sort_by(|a, b| time(a).unwrap_or(0.0).total_cmp(&time(b).unwrap_or(0.0)));
        let words =
            on.iter().filter_map(|r| Some(format!("{} ({:.2} ms, {})", r.name, time(r)?, metric.text(r.error?.mean))));
        words.collect::<Vec<_>>().join(" → ")
    };
    format!(
        "- Frontier as measured here: {}\n- Frontier as modelled for a {}, not measured: {}\n",
        list(|r| r.best, |r| r.ms.map(|b| b.mean)),
        GTX_1050.name,
        list(|r| r.best_projected, |r| r.projected_ms)
    )
}

fn generator(record: &Record) -> String {
    let Some(g) = &record.generator else { return String::new() };
    let [w, h] = g.size;
    let modelled = g.modelled().map_or("no, as its threads were not counted".into(), |m| format!("{m:.0} ms"));
    let ran = match (&g.wall_ms, &g.failed) {
        (Some(ms), _) => format!("takes {:.1} ms here by the clock", ms.median),
        (None, Some(why)) => format!("was not run: {why}"),
        _ => "was not run".into(),
    };
    format!(
        "**The paper's generator** ({} parameters, group norm, numbers nobody trained) at {w}×{h} {ran}, the raster \
         before it not counted; \
         {:.1} GFLOP by count; modelled for a {}: {modelled}. Printed by its authors: {PRINTED_MS:.0} ms on that card \
         at 1024×512, by a clock that \
         did not wait for the GPU, and L1 {PRINTED_L1:.0} on their own 375 pictures.\n",
        g.parameters,
        g.gflop(),
        GTX_1050.name
    )
}

fn by_scene(record: &Record, metric: Metric) -> String {
    let scenes: Vec<&str> = record.scenes.iter().filter(|s| s.failed.is_none()).map(|s| s.name.as_str()).collect();
    let mut text = format!("| | {} | mean |\n|{}\n", scenes.join(" | "), "---|".repeat(scenes.len() + 2));
    for row in rows(record, metric) {
        let cell = |scene: &&str| {
            let unit = record.units.iter().find(|u| u.entry == row.name && u.scene == **scene && u.failed.is_none());
            let value = unit.and_then(|u| metric.of(u.scores.as_ref()?));
            value.map_or("—".to_owned(), |v| metric.text(v))
        };
        let mean = row.error.filter(|_| row.whole).map_or("—".to_owned(), |b| metric.text(b.mean));
        let cells: Vec<String> = scenes.iter().map(cell).collect();
        let _ = writeln!(text, "| {} | {} | {mean} |", row.name, cells.join(" | "));
    }
    text
}

fn references(record: &Record) -> String {
    let mut text = String::from(
        "| scene | reference | samples a pixel | noise of its light: a pixel, a block of 4×4 | content \
         |\n|---|---|---|---|---|\n",
    );
    for scene in &record.scenes {
        let samples =
            scene.samples.map_or(String::new(), |[a, b]| if a == b { a.to_string() } else { format!("{a} to {b}") });
        let noise = scene.noise.map_or("not known".into(), |[p, b]| format!("{:.1} %, {:.1} %", 100.0 * p, 100.0 * b));
        let reference = scene.failed.as_deref().unwrap_or(&scene.reference);
        let _ = writeln!(text, "| {} | {reference} | {samples} | {noise} | {} |", scene.name, scene.hash);
    }
    let (error, most) = record.reference;
    let _ = writeln!(
        text,
        "\nOurs are traced until a pixel's noise is surely not above {:.1} % of the mean, with at most {most} \
         samples; noise is measured by two halves of the samples. \
         Below their own noise no error can be measured.",
        100.0 * error
    );
    text
}
