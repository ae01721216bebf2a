//! Formats that are not read, with the conversion to CSV in a few lines of Python.

use std::fmt;

/// File format that is not read: its name, and how to convert it to CSV.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ForeignKind {
    name: &'static str,
    conversion: &'static str,
}

const PANDAS_TABLE: &str = "\n  import pandas\n  pandas.read_parquet(\"FILE\").to_csv(\"FILE.csv\")";
const PANDAS_FEATHER: &str = "\n  import pandas\n  pandas.read_feather(\"FILE\").to_csv(\"FILE.csv\")";
const PANDAS_PICKLE: &str = "\n  import pandas\n  pandas.read_pickle(\"FILE\").to_csv(\"FILE.csv\")";
const NUMPY: &str = "\n  import numpy\n  numpy.savetxt(\"FILE.csv\", numpy.load(\"FILE\"), delimiter=\",\", header=\"t_s,…\", comments=\"\")";
const SQLITE: &str = "\n  import pandas, sqlite3\n  pandas.read_sql(\"select * from TABLE\", sqlite3.connect(\"FILE\")).to_csv(\"FILE.csv\")";
const TDMS: &str = "\n  from nptdms import TdmsFile\n  TdmsFile.read(\"FILE\").as_dataframe(time_index=True).to_csv(\"FILE.csv\")";
const MDF: &str = "\n  from asammdf import MDF\n  MDF(\"FILE\").to_dataframe().to_csv(\"FILE.csv\")";
const WAV: &str = "\n  from scipy.io import wavfile\n  rate, y = wavfile.read(\"FILE\")\n  \
     import numpy\n  numpy.savetxt(\"FILE.csv\", numpy.c_[numpy.arange(len(y)) / rate, y], delimiter=\",\", header=\"t_s,sound\", comments=\"\")";
const ULOG: &str = "; convert it with `ulog2csv FILE` (pip install pyulog)";
const DATAFLASH: &str =
    "; convert it with `mavlogdump.py --format csv --types MESSAGE FILE` (pip install pymavlink)";
const ROS: &str = "; docs/recordings.md has the conversion in Python (pip install rosbags)";
const UNPACK: &str = "; unpack it, and give the files in it";
const MEDIA: &str = "; augsim reads numbers: track the motion in it and export the positions as CSV";
const MATLAB_73: &str = "; save it in MATLAB with save('FILE.mat', '-v7'), or as CSV with writetable";

/// First bytes of each file format that is refused, with its name and conversion.
const KINDS: [(&[u8], ForeignKind); 24] = [
    (b"PAR1", kind("a Parquet file", PANDAS_TABLE)),
    (b"ARROW1", kind("an Arrow or Feather file", PANDAS_FEATHER)),
    (b"FEA1", kind("a Feather file", PANDAS_FEATHER)),
    (b"\x93NUMPY", kind("a numpy array (.npy)", NUMPY)),
    (b"\x80\x02", kind("a Python pickle", PANDAS_PICKLE)),
    (b"\x80\x03", kind("a Python pickle", PANDAS_PICKLE)),
    (b"\x80\x04", kind("a Python pickle", PANDAS_PICKLE)),
    (b"\x80\x05", kind("a Python pickle", PANDAS_PICKLE)),
    (b"SQLite format 3", kind("an SQLite database", SQLITE)),
    (b"TDSm", kind("a LabVIEW TDMS file", TDMS)),
    (b"MDF     ", kind("an MDF measurement file (.mf4, .mdf)", MDF)),
    (b"MATLAB 7.3", kind("a MATLAB 7.3 file", MATLAB_73)),
    (b"#ROSBAG", kind("a ROS bag", ROS)),
    (b"\x89MCAP0", kind("an MCAP file", ROS)),
    (b"ULog\x01", kind("a PX4 ULog file", ULOG)),
    (b"\xa3\x95", kind("an ArduPilot log", DATAFLASH)),
    (b"\xd0\xcf\x11\xe0", ForeignKind::SPREADSHEET),
    (b"BZh", kind("a bzip2 archive", UNPACK)),
    (b"\xfd7zXZ", kind("an xz archive", UNPACK)),
    (b"7z\xbc\xaf", kind("a 7z archive", UNPACK)),
    (b"Rar!", kind("a RAR archive", UNPACK)),
    (b"\x28\xb5\x2f\xfd", kind("a zstd archive", UNPACK)),
    (b"%PDF", kind("a PDF document", MEDIA)),
    (b"\x89PNG", kind("a PNG image", MEDIA)),
];

const fn kind(name: &'static str, conversion: &'static str) -> ForeignKind {
    ForeignKind { name, conversion }
}

impl ForeignKind {
    /// Refused format: an HDF5 file without vectors of numbers, such as one that pandas wrote.
    pub(super) const HDF5: ForeignKind = kind(
        "an HDF5 file without vectors of numbers",
        "\n  import pandas\n  pandas.read_hdf(\"FILE\").to_csv(\"FILE.csv\")",
    );
    /// Refused format: a spreadsheet other than `.xlsx`.
    pub(super) const SPREADSHEET: ForeignKind = kind(
        "a spreadsheet in an older or another format (.xls, .xlsb, .ods)",
        "; save it in the spreadsheet program as .xlsx or CSV",
    );

    /// Recognises a refused format from the first bytes of a file; `None` for any other file.
    pub(super) fn of(bytes: &[u8]) -> Option<ForeignKind> {
        if bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WAVE") {
            return Some(kind("a sound file (.wav)", WAV));
        }
        if bytes.get(4..8) == Some(b"ftyp")
            || bytes.starts_with(b"RIFF")
            || bytes.starts_with(b"\xff\xd8\xff")
        {
            return Some(kind("a video or an image", MEDIA));
        }
        if bytes.get(257..262) == Some(b"ustar") {
            return Some(kind("a tar archive", UNPACK));
        }
        KINDS.iter().find(|(begin, _)| bytes.starts_with(begin)).map(|(_, kind)| *kind)
    }
}

impl fmt::Display for ForeignKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_program = self.conversion.starts_with('\n');
        let lead = if is_program {
            ", which is not read; convert it to CSV with Python:"
        } else {
            ", which is not read"
        };
        write!(f, "this is {}{lead}{}", self.name, self.conversion)
    }
}
