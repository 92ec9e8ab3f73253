//! `bouncelight weights info | verify`: what a weights file holds, and whether it is sound.

use crate::net::{format::Weights, plan::Plan};
use anyhow::Result;
use std::path::PathBuf;

/// Size of the picture that the table is for, pixels.
const PICTURE: [u32; 2] = [1024, 512];

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Layers with shapes, FLOPs and bytes at the network's size for a 1024×512 picture.
    Info { file: PathBuf },
    /// Check everything a reader can check; says `ok` or lists every fault.
    Verify { file: PathBuf },
}

pub fn run(args: Args) -> Result<()> {
    match args.command {
        Command::Verify { file } => {
            let weights = Weights::load(&file)?;
            println!("ok: {} parameters in {}", weights.graph.parameters(), file.display());
        }
        Command::Info { file } => info(&Weights::load(&file)?)?,
    }
    Ok(())
}

fn info(weights: &Weights) -> Result<()> {
    let cells = PICTURE.map(|n| n.div_ceil(weights.cell));
    let plan = Plan::new(&weights.graph, cells[0], cells[1])?;
    let features: Vec<_> = weights.inputs.iter().map(|f| format!("{} {}", f.name, f.channels)).collect();
    println!("name       {}", weights.name);
    println!("file       {}, hash {}", weights.path.display(), weights.hash_text());
    println!("licence    {}", weights.licence);
    println!("inputs     {} (table {} {})", features.join(", "), weights.table.name, weights.table.version);
    println!("output     {}, {} channels", weights.output.meaning, weights.output.channels);
    println!("parameters {}", weights.graph.parameters());
    println!(
        "at {}x{} pixels ({}x{} cells): {:.3} GFLOP, {:.1} MB moved at least, arena of {:.1} MB\n",
        PICTURE[0],
        PICTURE[1],
        cells[0],
        cells[1],
        plan.flops() as f64 / 1e9,
        plan.traffic() as f64 / 1e6,
        plan.arena_bytes as f64 / 1e6
    );
    println!(
        "{:<10}{:<28}{:>16}{:>12}{:>10}{:>12}{:>12}",
        "layer", "kind", "result", "parameters", "MFLOP", "bytes", "offset"
    );
    for row in plan.rows() {
        let shape = format!("{}x{}x{}", row.shape.channels, row.shape.height, row.shape.width);
        println!(
            "{:<10}{:<28}{shape:>16}{:>12}{:>10.1}{:>12}{:>12}",
            row.name,
            row.kind,
            row.parameters,
            row.flops as f64 / 1e6,
            row.bytes,
            row.offset
        );
    }
    if !weights.provenance.is_empty() {
        println!("\nprovenance {}", serde_json::to_string_pretty(&weights.provenance)?);
    }
    Ok(())
}
