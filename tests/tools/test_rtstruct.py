#!/usr/bin/env python3
"""batten-rtstruct on structure sets that pydicom writes here: what it lists, converts, cuts and refuses.

  test_rtstruct.py CONVERTER [BATTEN]

BATTEN: the program, which must take what was converted as contours.
"""
import gzip
import os
import subprocess
import sys
import tempfile

converter, batten = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else None
try:
    import pydicom
    from pydicom.dataset import Dataset, FileDataset, FileMetaDataset
    from pydicom.sequence import Sequence
    from pydicom.uid import ExplicitVRLittleEndian, generate_uid
except ImportError:
    print("1..0 # SKIP pydicom is not installed")
    sys.exit(0)

count = failed = 0


def check(name, good, detail=""):
    global count, failed
    count += 1
    failed += not good
    print(f"{'ok' if good else 'not ok'} {count} - {name}")
    if not good:
        print(f"#   {detail}")


def run(*arguments):
    r = subprocess.run([sys.executable, converter, *arguments], capture_output=True, text=True)
    return r.returncode, r.stdout, r.stderr


def contour(points, kind="CLOSED_PLANAR"):
    c = Dataset()
    c.ContourGeometricType = kind
    c.NumberOfContourPoints = len(points)
    c.ContourData = [x for p in points for x in p]
    return c


def save(path, rois, modality="RTSTRUCT"):
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = "1.2.840.10008.5.1.4.1.1.481.3"
    meta.MediaStorageSOPInstanceUID = generate_uid(entropy_srcs=["batten"])
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    data = FileDataset(path, {}, file_meta=meta, preamble=b"\0" * 128)
    data.is_little_endian, data.is_implicit_VR = True, False
    data.Modality = modality
    data.StructureSetROISequence, data.ROIContourSequence = Sequence(), Sequence()
    for number, name, contours in rois:
        s, c = Dataset(), Dataset()
        s.ROINumber, s.ROIName = number, name
        c.ReferencedROINumber, c.ContourSequence = number, Sequence(contours)
        data.StructureSetROISequence.append(s)
        data.ROIContourSequence.append(c)
    data.save_as(path, write_like_original=False)


square = [("0.1", "0", "-98.44"), ("10.25", "0", "-98.44"), ("10.25", "10", "-98.44"), ("0.1", "10", "-98.44")]
upper = [(x, y, "-95.44") for x, y, _ in square]
# outer square, channel along y = 5 to a hole, around it, and back
keyhole = [("0", "0", "3"), ("10", "0", "3"), ("10", "5", "3"), ("7", "5", "3"), ("7", "7", "3"), ("3", "7", "3"),
           ("3", "5", "3"), ("7", "5", "3"), ("10", "5", "3"), ("10", "10", "3"), ("0", "10", "3")]

with tempfile.TemporaryDirectory() as folder:
    at = lambda name: os.path.join(folder, name)
    save(at("a.dcm"), [(4, "Body", [contour(square), contour(upper)]), (7, "Ring", [contour(keyhole)]),
                       (9, "Marks", [contour(square[:1], "POINT")])])
    status, out, err = run(at("a.dcm"), "--list")
    check("lists structures", status == 0 and out == "4\t2\t8\tBody\n7\t1\t11\tRing\n9\t1\t1\tMarks\n", out + err)
    expected = "".join(f"contour {len(c)}\n" + "".join(" ".join(p) + "\n" for p in c) for c in (square, upper))
    status, out, err = run(at("a.dcm"), "--structure", "Body")
    check("writes the numbers as they stand", status == 0 and out == expected, out + err)
    status, out, err = run(at("a.dcm"), "--structure", "body", "-o", at("b.txt.gz"))
    check("by a name in any letters, into a compressed file",
          status == 0 and gzip.open(at("b.txt.gz"), "rt").read() == expected, err)
    status, out, err = run(at("a.dcm"), "--structure", "7", "-o", at("ring.txt"))
    loops = [len(part.splitlines()) - 1 for part in open(at("ring.txt")).read().split("contour ")[1:]]
    check("cuts a keyhole into the outer side and the hole", status == 0 and sorted(loops) == [4, 5], f"{loops} {err}")
    check("and says so", "1 contours met themselves" in err, err)
    if batten:
        r = subprocess.run([batten, "inspect", at("ring.txt")], capture_output=True, text=True)
        check("batten reads it", r.returncode == 0 and "2, each in a plane" in r.stdout, r.stdout + r.stderr)
    for name, arguments, text, wanted in (
            ("points alone", ["--structure", "Marks"], "structure 'Marks' has no closed contours", 1),
            ("an unknown name", ["--structure", "Lung"], "no structure 'Lung'; there are 'Body', 'Ring', 'Marks'", 1),
            ("no name where there are several", [], "has 3 structures: 'Body', 'Ring', 'Marks'", 2)):
        status, out, err = run(at("a.dcm"), *arguments)
        check(f"refuses {name}", status == wanted and text in err and not out, err)
    save(at("ct.dcm"), [], "CT")
    for name, path, text in (("another modality", at("ct.dcm"), "its modality is CT, not RTSTRUCT"),
                             ("a file that is none", converter, "not a DICOM file"),
                             ("a file that is not there", at("none.dcm"), "No such file")):
        status, out, err = run(path, "--list")
        check(f"refuses {name}", status == 1 and text in err and err.count("\n") == 1, err)
    whole = open(at("a.dcm"), "rb").read()
    for name, data, arguments in (("a number that is none", whole.replace(b"10.25", b"10x25"), ["--structure", "Body"]),
                                  ("a number that is not finite", whole.replace(b"10.25", b"  nan"), ["--structure", "4"]),
                                  ("a file that is cut off", whole[:len(whole) - 100], ["--list"])):
        with open(at("bad.dcm"), "wb") as file:
            file.write(data)
        status, out, err = run(at("bad.dcm"), *arguments)
        check(f"refuses {name} in one line", status == 1 and "bad.dcm: " in err and err.count("\n") == 1, err)
    os.unlink(at("bad.dcm"))
    if os.path.exists("/dev/full"):
        with open("/dev/full", "w") as full:
            r = subprocess.run([sys.executable, converter, at("a.dcm"), "--list"], stdout=full, stderr=subprocess.PIPE,
                               text=True)
        check("tells in one line that its output cannot be written",
              r.returncode == 1 and "standard output: " in r.stderr and r.stderr.count("\n") == 1, r.stderr)
    status, out, err = run(at("a.dcm"), "--structure", "Body", "-o", at("none/b.txt"))
    check("refuses a folder that is not there", status == 1 and "No such file" in err, err)
    check("leaves nothing behind", sorted(os.listdir(folder)) == ["a.dcm", "b.txt.gz", "ct.dcm", "ring.txt"],
          str(os.listdir(folder)))
print(f"1..{count}")
sys.exit(failed > 0)
