//! The tuner and its cache.

use crate::{TOLERANCE, cases, common, error, fixed, fixture, run_gpu, run_network};
use bouncelight::net::format::Weights;
use bouncelight::net::gpu::{Choice, Facts, Kernel, KernelConfig, Network, Options, Setup, Source, Tuned, Variant};
use bouncelight::net::graph::Shape;
use bouncelight::net::plan::{self, Plan, Precision};
use bouncelight::net::tune::{Cache, CacheError, MAX_TEXT, VERSION, tune};
use bouncelight::wgpu::{AdapterInfo, Backend, DeviceType};
use bouncelight_lab::network::cpu::{self, Tensor};
use std::sync::Arc;

const GOOD: &str = r#"{"version": 5, "devices": {"a | Vulkan | d 1": {"layer": {"permutation":
    {"weights": "uniform", "vectors": 2}, "ms": 0.5}}}}"#;

fn info(name: &str, driver_info: &str) -> AdapterInfo {
    let mut info = AdapterInfo::new(DeviceType::Other, Backend::Vulkan);
    (info.name, info.driver, info.driver_info) = (name.into(), "d".into(), driver_info.into());
    info
}

#[test]
fn a_cache_survives_its_text_and_knows_its_device() {
    let cache = Cache::parse(GOOD).unwrap();
    assert_eq!(Cache::parse(&cache.text()).unwrap(), cache);
    assert_eq!(VERSION, 5, "adapt the texts here");
    let known = cache.tuned(&info("a", "1"));
    assert_eq!(known["layer"], KernelConfig::new(Source::Uniform, 2));
    // Negative control: another adapter, another driver.
    assert!(cache.tuned(&info("b", "1")).is_empty() && cache.tuned(&info("a", "2")).is_empty());
}

#[test]
fn foreign_caches_are_refused() {
    let cut = &GOOD[..GOOD.len() - 3];
    let nested = "[".repeat(100_000);
    for text in [
        "",
        "null",
        "[]",
        "{}",
        "\u{0}\u{1}",
        cut,
        &nested,
        &GOOD.replace("ms", "seconds"),
        &GOOD.replace("uniform", "x"),
    ] {
        assert!(matches!(Cache::parse(text), Err(CacheError::Text(_))), "{text:.40}");
    }
    for (from, to) in [
        ("\"vectors\": 2", "\"vectors\": 0"),
        ("\"vectors\": 2", "\"vectors\": 5"),
        ("\"vectors\": 2", "\"vectors\": 2, \"parts\": 0"),
        ("\"vectors\": 2", "\"vectors\": 2, \"parts\": 65"),
        ("0.5", "-0.5"),
    ] {
        assert!(matches!(Cache::parse(&GOOD.replace(from, to)), Err(CacheError::Numbers(_))), "{to}");
    }
    assert!(Cache::parse(&GOOD.replace("\"ms\": 0.5", "\"ms\": 1e999")).is_err());
    assert!(matches!(Cache::parse(&GOOD.replace(": 5,", ": 4,")), Err(CacheError::Version { found: 4 })));
    assert!(matches!(Cache::parse(&" ".repeat(MAX_TEXT + 1)), Err(CacheError::Long(_))));
}

#[test]
fn what_is_tuned_is_remembered_and_right() {
    let Some(gpu) = common::gpu() else { return };
    let weights = Weights::load(&fixture("conv1x1.safetensors")).unwrap();
    let (input, reference) = cases("conv1x1").pop().unwrap();
    let size = [input.shape.width, input.shape.height];
    let (mut cache, handles) = (Cache::default(), (&gpu.device, &gpu.queue));
    let reports = tune(handles, &weights, size, Options::default(), &mut cache, false, |_, _| true).unwrap();
    assert_eq!(reports.len(), 1);
    let report = &reports[0];
    assert!(report.tried > 2 && report.best.1 > 0.0 && report.guess.1 > 0.0, "{report:?}");
    // The second time nothing is left to do, and the choice stands.
    let again = tune(handles, &weights, size, Options::default(), &mut cache, false, |_, _| true).unwrap();
    assert!(again.is_empty());
    let tuned = Arc::new(cache.tuned(&gpu.info));
    assert_eq!(tuned.len(), 1);
    let network = Network::new(&gpu.device, &gpu.queue, &weights, size, Setup { tuned, ..Setup::default() }).unwrap();
    let kernel = network.kernels().next().unwrap();
    assert_eq!(kernel.config, Some(report.best.0));
    assert!(error(&run_network(&gpu, &network, &input), &reference) <= TOLERANCE);
}

/// A cache may ask for what a layer cannot do; what runs then is the nearest that it can.
#[test]
fn wishes_that_cannot_be_met_do_no_harm() {
    let Some(gpu) = common::gpu() else { return };
    let weights = Weights::load(&fixture("conv1x1.safetensors")).unwrap();
    let (input, reference) = cases("conv1x1").pop().unwrap();
    let size = [input.shape.width, input.shape.height];
    let plain = Network::new(&gpu.device, &gpu.queue, &weights, size, Options::default()).unwrap();
    let layer = plain.kernels().next().unwrap().layer.unwrap().to_string();
    for wish in [
        KernelConfig { parts: 4000, half: true, ..KernelConfig::new(Source::Staged, 4000) },
        KernelConfig::new(Source::Uniform, 0),
    ] {
        let tuned: Arc<Tuned> = Arc::new([(layer.clone(), wish)].into());
        let network =
            Network::new(&gpu.device, &gpu.queue, &weights, size, Setup { tuned, ..Setup::default() }).unwrap();
        assert!(error(&run_network(&gpu, &network, &input), &reference) <= TOLERANCE, "{wish:?}");
    }
    // Negative control: the permutation that is asked for is the one that runs.
    let Variant::Fixed(wanted) = fixed(Source::Storage, 1) else { unreachable!() };
    let options = Options { variant: Variant::Fixed(wanted), ..Options::default() };
    let network = Network::new(&gpu.device, &gpu.queue, &weights, size, options).unwrap();
    assert_eq!(network.kernels().next().unwrap().config, Some(wanted));
    assert!(error(&run_gpu(&gpu, &weights, &input, options), &reference) <= TOLERANCE);
}

/// What a GPU runs that nobody has tuned, a mixture of kernels, answers as the CPU reference does.
#[test]
fn the_shipped_network_runs_untuned_as_on_a_gpu() {
    let Some(gpu) = common::gpu() else { return };
    let weights = Weights::shipped().unwrap();
    let shape = Shape { channels: weights.graph.input_channels, width: 128, height: 64 };
    let wave = |i: usize| (i as f32 * 0.37).sin();
    let input = Tensor { shape, data: (0..shape.channels as usize * 128 * 64).map(wave).collect() };
    let reference = cpu::run(&weights, &input).unwrap();
    let facts = Facts { software: false, half: false };
    for (precision, tolerance) in [(Precision::F32, TOLERANCE), (Precision::F16, 2e-2)] {
        let options = Options { precision, ..Options::default() };
        let planned = plan::Options { precision, ..plan::Options::default() };
        let plan = Plan::with(&weights.graph, 128, 64, &planned).unwrap();
        let chosen =
            |step| Kernel::choose(&plan, step, &Choice { variant: Variant::Auto, tuned: &Tuned::new(), facts });
        let kernels: Vec<Kernel> = plan.steps.iter().map(chosen).collect();
        let layers = kernels.iter().filter_map(|k| Some((k.layer?.to_string(), k.config?)));
        let tuned: Arc<Tuned> = Arc::new(layers.collect());
        // Of all kinds: cut into parts, whole, and not what a processor runs.
        assert!(tuned.values().any(|c| c.parts > 1) && tuned.values().any(|c| c.parts == 1));
        let network = Network::new(&gpu.device, &gpu.queue, &weights, [128, 64], Setup { options, tuned }).unwrap();
        let runs: Vec<_> = network.kernels().map(|k| k.config).collect();
        assert_eq!(runs, kernels.iter().map(|k| k.config).collect::<Vec<_>>());
        let e = error(&run_network(&gpu, &network, &input), &reference);
        println!("{precision:?}: {e:.1e}");
        assert!(e <= tolerance, "{precision:?}: {e}");
        let plain = Network::new(&gpu.device, &gpu.queue, &weights, [128, 64], options).unwrap();
        assert_ne!(runs, plain.kernels().map(|k| k.config).collect::<Vec<_>>());
    }
    // Negative control: another input is told apart.
    let other = Tensor { shape, data: input.data.iter().map(|x| 0.9 * x).collect() };
    assert!(error(&cpu::run(&weights, &other).unwrap(), &reference) > 2e-2);
}
