//! The record as Markdown.

use super::{FrameRow, HardwareReport};
use crate::study::projection::{Card, GTX_1050, GTX_1650, modelled};
use std::fmt::Write;

impl HardwareReport {
    /// The tables of `docs/measured/DEVICE.md`. What is modelled is marked as such.
    pub fn markdown(&self) -> String {
        let mut text = String::new();
        // Writing into a text cannot fail.
        let _ = self.write(&mut text);
        text
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "# {}\n", self.device.adapter)?;
        writeln!(
            out,
            "Made by `cargo xtask gpu-report`; the numbers with all digits stand in the JSON file beside this one.\n"
        )?;
        writeln!(
            out,
            "{} ({}), bouncelight {}{}, weights {}; {:.0} s.",
            self.device.driver,
            self.device.backend,
            self.version,
            self.commit.as_ref().map_or(String::new(), |c| format!(" at commit {c}")),
            self.weights,
            self.seconds
        )?;
        if self.device.software {
            writeln!(out, "**A driver on the processor: a rehearsal, which says nothing about any GPU.**")?;
        }
        if self.debug_build {
            writeln!(
                out,
                "**Built without optimisation for release**, so clocks count slow code on the processor, too."
            )?;
        }
        let cores = std::thread::available_parallelism().map_or(1, usize::from) as f64;
        if let Some(load) = self.load.filter(|load| *load > 0.5 * cores) {
            writeln!(out, "**A busy machine**: load {load:.1} before the beginning.")?;
        }
        writeln!(
            out,
            "\nPeaks, measured: {:.1} GFLOP/s of multiplications and additions, {:.1} GB/s copied (32 MiB: on a \
             device with a larger cache that is the cache's rate).\n",
            self.peak_flops / 1e9,
            self.peak_bytes / 1e9
        )?;
        self.write_frames(out)?;
        self.write_shares(out)?;
        self.write_passes(out)?;
        self.write_network(out)?;
        self.write_rays(out)?;
        if !self.left_out.is_empty() {
            writeln!(out, "\n## Left out\n")?;
            self.left_out.iter().try_for_each(|what| writeln!(out, "- {what}"))?;
        }
        Ok(())
    }

    fn write_frames(&self, out: &mut String) -> std::fmt::Result {
        let here = Card::of_adapter(&self.device.adapter);
        writeln!(out, "## Methods\n")?;
        writeln!(
            out,
            "Milliseconds; medians. The last columns are modelled, not measured, with a range that eight of ten passes \
             kept to that the model had not seen. *Own*: the passes that find and add indirect light{}. *Measured / \
             modelled*: own passes over what the model says of this device{}.\n",
            if self.frames.iter().any(|r| r.measured.own_ms().is_none()) {
                ", by their timestamps; with `~` by the synchronised clock less that of `direct`, where timestamps \
                 are missing or do not agree with it"
            } else {
                ", by their timestamps, which agree with the synchronised clock within 10 %"
            },
            if here.is_some() { "" } else { ", whose data sheet is not known" }
        )?;
        writeln!(
            out,
            "| scene | size | method | own, median | all passes | p95 | clock | MiB | **measured / modelled** | {}, \
             modelled | {}, modelled |",
            GTX_1050.name, GTX_1650.name
        )?;
        writeln!(out, "|---|---|---|---|---|---|---|---|---|---|---|")?;
        for r in &self.frames {
            let m = &r.measured;
            let time = |t: Option<f64>| t.map_or("-".into(), |t| format!("{t:.2}"));
            let counted = m.costs.iter().any(|c| c.dispatches > 0.0);
            let of = |card: &Card| if counted { modelled(&m.costs, card).to_string() } else { "-".into() };
            let (mark, own) = m.own_ms().map_or(("~", r.own_ms), |ms| ("", ms));
            let ratio = here.filter(|_| counted).map(|card| own / modelled(&m.costs, &card).ms);
            let method = if r.precision == "f32" { m.method.clone() } else { format!("{}, {}", m.method, r.precision) };
            writeln!(
                out,
                "| {} | {}x{} | `{method}` | {mark}{own:.2} | {} | {} | {:.2} | {:.0} | {} | {} | {} |",
                r.scene,
                r.size[0],
                r.size[1],
                time(m.gpu_ms.map(|t| t.median)),
                time(m.gpu_ms.map(|t| t.p95)),
                m.wall_ms.median,
                m.total_bytes() as f64 / f64::from(1 << 20),
                ratio.filter(|r| *r > 0.0).map_or("-".into(), |r| format!("**{r:.2}**")),
                of(&GTX_1050),
                of(&GTX_1650),
            )?;
        }
        Ok(())
    }

    /// Passes of the first scene at the size that all scenes share: a column a method.
    fn write_passes(&self, out: &mut String) -> std::fmt::Result {
        let Some(first) = self.frames.first() else { return Ok(()) };
        let same = |r: &&FrameRow| r.scene == first.scene && r.size == first.size && r.precision == first.precision;
        let rows: Vec<&FrameRow> = self.frames.iter().filter(same).collect();
        let mut passes: Vec<&str> = Vec::new();
        // The last method has most passes, and so the order of most.
        for pass in rows.iter().rev().flat_map(|r| &r.measured.passes) {
            if !pass.pass.starts_with("net.") && !passes.contains(&pass.pass.as_str()) {
                passes.push(&pass.pass);
            }
        }
        if passes.is_empty() {
            return Ok(());
        }
        writeln!(out, "\n## Passes\n")?;
        writeln!(
            out,
            "{}, {}x{}: median milliseconds by timestamps, and in brackets what a {} is modelled to take.\n",
            first.scene, first.size[0], first.size[1], GTX_1050.name
        )?;
        writeln!(
            out,
            "| pass | {} |",
            rows.iter().map(|r| r.measured.method.as_str()).collect::<Vec<_>>().join(" | ")
        )?;
        writeln!(out, "|---{}|", "|---".repeat(rows.len()))?;
        for pass in passes {
            let cell = |r: &&FrameRow| {
                let cost = r.measured.costs.iter().find(|c| c.pass == pass);
                let projected = cost.map(|c| modelled([c], &GTX_1050).ms);
                let measured = r.measured.passes.iter().find(|p| p.pass == pass);
                measured.map_or("".into(), |p| match projected {
                    Some(projected) => format!("{:.3} ({projected:.2})", p.ms.median),
                    None => format!("{:.3}", p.ms.median),
                })
            };
            writeln!(out, "| {pass} | {} |", rows.iter().map(cell).collect::<Vec<_>>().join(" | "))?;
        }
        Ok(())
    }

    fn write_network(&self, out: &mut String) -> std::fmt::Result {
        if self.network.is_empty() {
            return Ok(());
        }
        writeln!(out, "\n## The network\n")?;
        writeln!(
            out,
            "Each layer alone, by the clock. *Of the peaks*: what the measured peaks allow at best over what it took.\n"
        )?;
        writeln!(out, "| picture | input | numbers | kernels | ms | GFLOP/s | of the peaks | slowest layer |")?;
        writeln!(out, "|---|---|---|---|---|---|---|---|")?;
        for r in &self.network {
            let slowest = r.layers.layers.iter().max_by(|a, b| a.ms.total_cmp(&b.ms));
            writeln!(
                out,
                "| {}x{} | {}x{} | {} | {} | {:.3} | {:.1} | {:.0} % | {} |",
                r.size[0],
                r.size[1],
                r.cells[0],
                r.cells[1],
                r.precision,
                if r.tuned { "tuned" } else { "guessed" },
                r.layers.ms(),
                r.layers.flops() / r.layers.ms() / 1e6,
                100.0 * r.layers.least_ms() / r.layers.ms(),
                slowest.map_or(String::new(), |l| format!("{} {:.3} ms, {}", l.name, l.ms, l.kernel)),
            )?;
        }
        let other = match &self.pytorch {
            serde_json::Value::String(reason) => format!("PyTorch was not measured: {reason}"),
            serde_json::Value::Null => "PyTorch was not asked for.".into(),
            found => {
                let field = |name: &str| found.get(name).map_or("-".into(), |v| v.to_string().replace('"', ""));
                let mut text = format!(
                    "PyTorch {} on {}, channels last, same weights and size: {} ms, compiled {} ms.",
                    field("version"),
                    field("device"),
                    field("ms"),
                    field("compiled_ms")
                );
                let ours = self.network.iter().filter(|r| r.precision == "f32").map(|r| r.layers.ms());
                let best = ours.fold(f64::INFINITY, f64::min);
                if let Some(ms) = found.get("ms").and_then(serde_json::Value::as_f64) {
                    write!(text, " Ours / PyTorch: {:.2}.", best / ms)?;
                }
                text
            }
        };
        writeln!(out, "\n{other}")
    }

    fn write_rays(&self, out: &mut String) -> std::fmt::Result {
        if !self.rays.is_empty() {
            writeln!(out, "\n## Rays\n")?;
            writeln!(out, "Million a second; `nothing` is what reading rays and writing hits costs.\n")?;
            writeln!(
                out,
                "| scene | triangles | MiB | primary | shadow | diffuse | blocks visited, primary / diffuse |"
            )?;
            writeln!(out, "|---|---|---|---|---|---|---|")?;
            for r in &self.rays {
                let ([p, s, d], [a, _, c]) = (r.mrays, r.visits);
                let mib = r.bytes as f64 / f64::from(1 << 20);
                let (scene, triangles) = (&r.scene, r.triangles);
                writeln!(out, "| {scene} | {triangles} | {mib:.1} | {p:.2} | {s:.2} | {d:.2} | {a:.1} / {c:.1} |")?;
            }
        }
        if !self.tracer.is_empty() {
            writeln!(out, "\n## The path tracer\n\n| scene | size | million paths a second |\n|---|---|---|")?;
            for r in &self.tracer {
                writeln!(out, "| {} | {}x{} | {:.3} |", r.scene, r.size[0], r.size[1], r.mpaths)?;
            }
        }
        Ok(())
    }
}
