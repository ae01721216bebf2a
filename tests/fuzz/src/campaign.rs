//! Fuzzing campaigns: series of mutated input files, each determined by the campaign's seed and its number.

use crate::reader::{Files, Reader};
use crate::readers::READERS;
use crate::seeds;
use augsim_data::random_stream;
use rand::RngExt;

/// A series of mutated input files for some file readers.
#[derive(Debug)]
pub struct Campaign {
    seed: u64,
    readers: Vec<(Reader, Vec<Files>)>,
}

impl Campaign {
    /// Makes the campaign with this seed on all file readers, or on the one called `only`.
    ///
    /// # Errors
    /// There is no such reader, or its seed files cannot be made.
    pub fn new(seed: u64, only: Option<&str>) -> anyhow::Result<Self> {
        let mut readers = Vec::new();
        for reader in READERS.into_iter().filter(|r| only.is_none_or(|name| name == r.name)) {
            let files = seeds::of(reader.name)?;
            anyhow::ensure!(!files.is_empty(), "the reader {} has no seed files", reader.name);
            readers.push((reader, files));
        }
        let names = READERS.map(|r| r.name).join(", ");
        anyhow::ensure!(
            !readers.is_empty(),
            "there is no reader `{}`; choose one of {names}",
            only.unwrap_or_default()
        );
        Ok(Campaign { seed, readers })
    }

    /// Makes input number `index`: the file reader, and its seed files with one of them mutated.
    pub fn input(&self, index: u64) -> (Reader, Files) {
        let (reader, seeds) = &self.readers[(index % self.readers.len() as u64) as usize];
        let mut rng = random_stream(self.seed, "fuzz", index);
        let mut files = seeds[rng.random_range(0..seeds.len())].clone();
        let donor = &seeds[rng.random_range(0..seeds.len())].0;
        let file_index = rng.random_range(0..files.0.len());
        let donor = &donor[file_index.min(donor.len() - 1)].1;
        files.0[file_index].1 = reader.envelope.mutate(&mut rng, &files.0[file_index].1, donor);
        (*reader, files)
    }
}
