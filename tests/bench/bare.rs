//! A bare reading of delimited files by the csv crate: the peer of `ingest` in `tests/reference/ingest_speed.py`.

/// Reads every record of the files, one after the other, and prints how many rows and bytes of fields there were.
pub fn read(files: &[String]) {
    let (mut rows, mut bytes, mut record) = (0u64, 0usize, csv::ByteRecord::new());
    for file in files {
        let mut reader =
            csv::Reader::from_path(file).unwrap_or_else(|error| panic!("{file}: {error}"));
        while reader
            .read_byte_record(&mut record)
            .unwrap_or_else(|error| panic!("{file}: {error}"))
        {
            rows += 1;
            bytes += record.as_slice().len();
        }
    }
    println!("{rows} rows, {bytes} bytes");
}
