//! Contract: files of other programs are read as the same table of text would be, and a format that is not
//! read is named, with a conversion.

use augsim_data::{
    DataError, Dataset, MissingCells, NamedCsv, RecognitionOptions, Unit, read_dataset, recognise,
};
use std::io::Write;
use std::path::PathBuf;

/// Writes a file with the content `bytes` and reads it as a data set without a model.
fn read(name: &str, bytes: &[u8]) -> Result<Dataset, DataError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("a file");
    read_dataset(&path, MissingCells::AsGap)
}

fn error(name: &str, bytes: &[u8]) -> String {
    read(name, bytes).expect_err(name).to_string()
}

fn zip(members: &[(&str, &[u8])]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, content) in members {
        archive.start_file(*name, zip::write::SimpleFileOptions::default()).expect("a member");
        archive.write_all(content).expect("content");
    }
    archive.finish().expect("an archive").into_inner()
}

/// Bytes of an Excel workbook with the cells `rows`, row by row; texts are inline.
fn workbook(rows: &[&[&str]]) -> Vec<u8> {
    let cell = |(row, column, text): (usize, usize, &str)| {
        let place = format!("{}{}", char::from(b'A' + column as u8), row + 1);
        match text.parse::<f64>() {
            Ok(_) => format!("<c r=\"{place}\"><v>{text}</v></c>"),
            Err(_) => format!("<c r=\"{place}\" t=\"inlineStr\"><is><t>{text}</t></is></c>"),
        }
    };
    let row = |(r, cells): (usize, &&[&str])| {
        let cells: String = cells.iter().enumerate().map(|(c, text)| cell((r, c, text))).collect();
        format!("<row r=\"{}\">{cells}</row>", r + 1)
    };
    let rows: String = rows.iter().enumerate().map(row).collect();
    let main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main";
    let office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
    let sheet = format!("<worksheet xmlns=\"{main}\"><sheetData>{rows}</sheetData></worksheet>");
    let book = format!(
        "<workbook xmlns=\"{main}\" xmlns:r=\"{office}\"><sheets><sheet name=\"log\" sheetId=\"1\" r:id=\"rId1\"/></sheets></workbook>"
    );
    let package = "http://schemas.openxmlformats.org/package/2006/relationships";
    let links = format!(
        "<Relationships xmlns=\"{package}\"><Relationship Id=\"rId1\" Type=\"{office}/worksheet\" Target=\"worksheets/sheet1.xml\"/></Relationships>"
    );
    let root = format!(
        "<Relationships xmlns=\"{package}\"><Relationship Id=\"rId1\" Type=\"{office}/officeDocument\" Target=\"xl/workbook.xml\"/></Relationships>"
    );
    zip(&[
        ("_rels/.rels", root.as_bytes()),
        ("xl/workbook.xml", book.as_bytes()),
        ("xl/_rels/workbook.xml.rels", links.as_bytes()),
        ("xl/worksheets/sheet1.xml", sheet.as_bytes()),
    ])
}

/// Bytes of a data element of a MATLAB file with the type code `kind`.
fn element(kind: u32, content: &[u8]) -> Vec<u8> {
    let mut out = [kind.to_le_bytes(), (content.len() as u32).to_le_bytes()].concat();
    out.extend(content);
    out.resize(out.len().div_ceil(8) * 8, 0);
    out
}

/// Bytes of a MATLAB file with column vectors of doubles, compressed as in version 7 or plain as in version 5.
fn mat(vectors: &[(&str, &[f64])], compressed: bool) -> Vec<u8> {
    let mut out = b"MATLAB 5.0 MAT-file, Platform: GLNXA64".to_vec();
    out.resize(124, b' ');
    out.extend([0, 1, b'I', b'M']);
    for (name, values) in vectors {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let dimensions = [(values.len() as i32).to_le_bytes(), 1_i32.to_le_bytes()].concat();
        let content = [
            element(6, &[6, 0, 0, 0, 0, 0, 0, 0]),
            element(5, &dimensions),
            element(1, name.as_bytes()),
            element(9, &bytes),
        ];
        let matrix = element(14, &content.concat());
        if compressed {
            let mut packed = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
            packed.write_all(&matrix).expect("compressed");
            let packed = packed.finish().expect("compressed");
            out.extend([15_u32.to_le_bytes(), (packed.len() as u32).to_le_bytes()].concat());
            out.extend(packed);
        } else {
            out.extend(matrix);
        }
    }
    out
}

#[test]
fn other_formats_are_read_like_the_table_of_text() {
    let (times, angles) = ([0.0, 0.02, 0.04, 0.06], [0.4, 0.39, 0.37, 0.34]);
    let lvm = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\nX_Columns\tOne\n***End_of_Header***\t\n\nChannels\t1\t\n\
               Y_Unit_Label\trad\t\nX0\t0,0\t\nDelta_X\t0,02\t\n***End_of_Header***\t\t\nX_Value\tangle\tComment\n\
               0,00\t0,40\n0,02\t0,39\n0,04\t0,37\n0,06\t0,34\n";
    let csv = "t_s,angle_rad\n0,0.4\n0.02,0.39\n0.04,0.37\n0.06,0.34\n";
    let book = workbook(&[
        &["Pendulum"],
        &["time (s)", "angle (rad)"],
        &["0", "0.4"],
        &["0.02", "0.39"],
        &["0.04", "0.37"],
        &["0.06", "0.34"],
    ]);
    let records: Vec<String> =
        times.iter().zip(&angles).map(|(t, a)| format!("{{\"t_s\": {t}, \"angle_rad\": {a}}}")).collect();
    let columns = format!("{{\"time\": {times:?}, \"angle (rad)\": {angles:?}}}");
    let vectors: [(&str, &[f64]); 3] = [("t_s", &times), ("angle_rad", &angles), ("mass_kg", &[2.0])];
    for (name, bytes) in [
        ("a.lvm", lvm.as_bytes().to_vec()),
        ("a.csv.zip", zip(&[("a.csv", csv.as_bytes()), ("__MACOSX/._a.csv", b"x")])),
        ("a.xlsx", book),
        ("records.json", format!("[{}]", records.join(", ")).into_bytes()),
        ("records.jsonl", records.join("\n").into_bytes()),
        ("columns.json", columns.clone().into_bytes()),
        ("inner.json", format!("{{\"name\": \"swing\", \"data\": {columns}}}").into_bytes()),
        ("v5.mat", mat(&vectors, false)),
        ("v7.mat", mat(&vectors, true)),
    ] {
        let data = read(name, &bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        let angle = data.column_index("angle_rad").unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(data.trajectories().len(), 1, "{name}");
        assert_eq!(data.trajectories()[0].time_s(), times, "{name}");
        assert_eq!(data.trajectories()[0].column(angle), angles, "{name}");
        // The reader of models' columns reads the same.
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join(name);
        std::fs::write(&path, &bytes).expect("a file");
        let named = NamedCsv::open(&path).and_then(|csv| csv.read(&[("angle_rad", Unit::RADIAN)]));
        assert_eq!(
            named.unwrap_or_else(|e| panic!("{name}: {e}")).trajectories()[0].column(0),
            angles,
            "{name}"
        );
    }
}

#[test]
fn one_column_and_printed_lists_are_read() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("log.txt");
    for (text, name) in [("0.4\n0.3\n0.2\n", "column_1"), ("angle_rad\n0.4\n0.3\n0.2\n", "angle_rad")] {
        std::fs::write(&path, text).expect("a file");
        let reading = RecognitionOptions { rate_hz: Some(50.0), ..RecognitionOptions::default() };
        let paths: [PathBuf; 1] = [path.clone()];
        let data =
            recognise(&paths, &reading, MissingCells::AsGap).unwrap_or_else(|e| panic!("{text}: {e}")).data;
        assert_eq!(data.columns()[0].name(), name, "{text}");
        assert_eq!(data.trajectories()[0].time_s(), [0.0, 0.02, 0.04], "{text}");
        assert_eq!(data.trajectories()[0].column(0), [0.4, 0.3, 0.2], "{text}");
        assert!(error("log.txt", text.as_bytes()).contains("--rate-hz"), "{text}");
    }
    let data = read("list.txt", b"{0.00, 0.40},\n{0.02, 0.39},\n{0.04, 0.37}\n").expect("a list");
    assert_eq!(data.trajectories()[0].column(0), [0.40, 0.39, 0.37]);
}

#[test]
fn a_format_that_is_not_read_is_named() {
    for (name, bytes, texts) in [
        ("a.parquet", &b"PAR1\x15\x04"[..], &["a Parquet file", "pandas.read_parquet"][..]),
        ("a.npy", b"\x93NUMPY\x01\x00", &["numpy array", "numpy.savetxt"]),
        ("a.tdms", b"TDSm\x0e", &["TDMS", "TdmsFile"]),
        ("a.mf4", b"MDF     4.10", &["MDF", "asammdf"]),
        ("a.xls", b"\xd0\xcf\x11\xe0\xa1\xb1", &["spreadsheet", ".xlsx or CSV"]),
        ("a.mat", b"MATLAB 7.3 MAT-file, Platform", &["MATLAB 7.3", "-v7"]),
        ("a.mp4", b"\0\0\0\x20ftypisom", &["a video", "positions"]),
        ("a.json", b"{\"name\": \"x\"}", &["JSON", "not a table", "list of records"]),
        ("a.json", b"[{\"t_s\": NaN}]", &["JSON", "write null"]),
        ("a.mat", b"MATLAB 5.0 MAT-file", &[]),
    ] {
        let error = error(name, bytes);
        for text in texts {
            assert!(error.contains(text), "{name}: `{text}` is not in: {error}");
        }
    }
    let two = zip(&[("a.csv", b"t_s,x_m\n0,1\n"), ("b.csv", b"t_s,x_m\n0,1\n")]);
    assert!(error("two.zip", &two).contains("unpack it"));
    // A workbook without its list of sheets, as a log of some instruments.
    let part = zip(&[("[Content_Types].xml", b"<Types/>"), ("xl/worksheets/sheet1.xml", b"<worksheet/>")]);
    assert!(error("part.xlsx", &part).contains("an Excel workbook"), "{}", error("part.xlsx", &part));
}

#[test]
fn a_damaged_file_is_no_panic() {
    let whole = mat(&[("t_s", &[0.0, 1.0, 2.0]), ("x_m", &[1.0, 2.0, 3.0])], true);
    let book = workbook(&[&["t_s", "x_m"], &["0", "1"], &["1", "2"]]);
    for bytes in [&whole, &book] {
        for length in (0..bytes.len()).step_by(7) {
            let _ = read("cut.bin", &bytes[..length]);
            let mut flipped = bytes.clone();
            flipped[length] ^= 0xff;
            let _ = read("flipped.bin", &flipped);
        }
    }
}
