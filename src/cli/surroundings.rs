//! Who runs calib, where and when: the only file that reads the environment and the clock.

use crate::pipeline::{Host, Surroundings, Tool};
use std::ffi::OsString;
use std::path::PathBuf;
use std::time::SystemTime;

pub(super) fn surroundings(command_line: &[OsString]) -> Surroundings {
    Surroundings {
        tool: Tool {
            name: env!("CARGO_PKG_NAME").into(),
            version: env!("CARGO_PKG_VERSION").into(),
            target: format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS),
        },
        host: Host {
            name: host_name(),
            os: std::env::consts::OS.into(),
            architecture: std::env::consts::ARCH.into(),
            cores: cores(),
        },
        command_line: command_line.iter().map(|part| part.to_string_lossy().into_owned()).collect(),
        now: SystemTime::now,
        run_id: ulid::Ulid::generate().to_string(),
    }
}

pub(super) fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn host_name() -> String {
    let from_kernel = std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let name = from_kernel.or_else(|| std::env::var("HOSTNAME").or_else(|_| std::env::var("COMPUTERNAME")).ok());
    name.map_or_else(|| "unknown".into(), |name| name.trim().to_string())
}

/// Where tables go when `--store` does not say.
pub(super) fn default_store() -> PathBuf {
    PathBuf::from(".calib")
}
