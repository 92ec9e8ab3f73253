//! A small card as its share of a large one: what the large one takes for as many times the pixels as
//! it has lanes more is about what the small one takes, clocks apart. Compute passes only, and a
//! lower bound rather: the larger card has larger caches for each of its lanes, too.

use super::{FrameRow, HardwareReport};
use crate::study::projection::{Card, GTX_1050, GTX_1650};
use std::fmt::Write;

/// The picture whose time is asked for, pixels.
const PICTURE: f64 = 1024.0 * 512.0;
/// How far a measured picture may be from the one that a share needs.
const FAR: f64 = 2.5;

/// Milliseconds of a method's own passes at 1024×512 on `small`, by its share of `large`.
fn share_ms(row: &FrameRow, large: &Card, small: &Card) -> f64 {
    let pixels = f64::from(row.size[0]) * f64::from(row.size[1]);
    own_ms(row) * times(large, small) * PICTURE / pixels * large.clock() / small.clock()
}

/// By timestamps, where they agree with the clock.
fn own_ms(row: &FrameRow) -> f64 {
    row.measured.own_ms().unwrap_or(row.own_ms)
}

/// How many of the small card the large one is.
fn times(large: &Card, small: &Card) -> f64 {
    large.multiprocessors * large.lanes / (small.multiprocessors * small.lanes)
}

impl HardwareReport {
    pub(super) fn write_shares(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "\n## Small cards as shares of this one\n")?;
        let Some(large) = Card::of_adapter(&self.device.adapter) else {
            return writeln!(out, "This device's data sheet is not known, so nothing can be said of a share of it.");
        };
        writeln!(
            out,
            "Scaled, not measured: what this card takes for as many times the pixels as it has lanes more, at the \
             small card's clock. A lower bound rather, as this card's caches are larger.\n"
        )?;
        writeln!(
            out,
            "| card | of this one | method | measured at | own, ms | **the card's share at 1024x512, ms** |"
        )?;
        writeln!(out, "|---|---|---|---|---|---|")?;
        let usual = self.frames.first().map(|r| r.scene.as_str());
        for small in [GTX_1050, GTX_1650] {
            let wanted = PICTURE * times(&large, &small);
            let far = |r: &FrameRow| (f64::from(r.size[0]) * f64::from(r.size[1]) / wanted).ln().abs();
            for method in ["gather", "neural"] {
                let rows = self.frames.iter().filter(|r| r.measured.method == method && r.precision == "f32");
                let rows = rows.filter(|r| Some(r.scene.as_str()) == usual && far(r) < FAR.ln());
                let Some(row) = rows.min_by(|a, b| far(a).total_cmp(&far(b))) else { continue };
                writeln!(
                    out,
                    "| {} | 1/{:.1} | `{method}` | {}x{} | {:.2} | **{:.1}** |",
                    small.name,
                    times(&large, &small),
                    row.size[0],
                    row.size[1],
                    own_ms(row),
                    share_ms(row, &large, &small)
                )?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shares_of_a_record_are_printed_and_those_of_unknown_devices_are_not() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/measured/nvidia-h100-80gb-hbm3.json");
        let mut report: HardwareReport =
            serde_json::from_str(&std::fs::read_to_string(path).expect("a record")).expect("a record");
        let text = report.markdown();
        let row = text.lines().find(|l| l.starts_with("| GTX 1050 | 1/26.4 | `gather` | 3840x2160")).expect("a share");
        // 4.42 ms for 16 times the pixels, at 1.98 against 1.45 GHz.
        let ms: f64 = row.split("**").nth(1).expect("a number").parse().expect("a number");
        assert!((ms - 4.42 * 26.4 / 15.82 * 1.363).abs() < 0.1, "{row}");
        assert!(text.contains("| GTX 1650 | 1/18.9 | `neural`"));
        report.device.adapter = "llvmpipe".into();
        assert!(report.markdown().contains("data sheet is not known"));
    }
}
