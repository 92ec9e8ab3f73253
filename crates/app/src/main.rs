//! The `bouncelight` program: parse the command line, run the subcommand, turn errors into exit
//! codes.

fn main() -> std::process::ExitCode {
    quiet_mesa();
    bouncelight_app::cli::main()
}

/// Without a display, Mesa's layer that asks the desktop for its preferred card only complains, on
/// standard error and past every `-q`. It reads this from its environment, which a running program
/// cannot change safely: the program starts anew with it.
#[cfg(target_os = "linux")]
fn quiet_mesa() {
    use std::os::unix::process::CommandExt;
    let set = |name: &str| std::env::var_os(name).is_some();
    if ["DISPLAY", "WAYLAND_DISPLAY", "NODEVICE_SELECT"].into_iter().any(set) {
        return;
    }
    let Ok(program) = std::env::current_exe() else { return };
    let mut args = std::env::args_os();
    let mut command = std::process::Command::new(program);
    if let Some(name) = args.next() {
        command.arg0(name);
    }
    // Returns only where it fails; then the complaint stays.
    let _ = command.args(args).env("NODEVICE_SELECT", "1").exec();
}

#[cfg(not(target_os = "linux"))]
fn quiet_mesa() {}
