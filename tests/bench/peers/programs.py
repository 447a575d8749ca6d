"""What the scripts that run weft, POV-Ray and Tachyon share: the scenes, the commands, running and timing them,
comparing the pictures, tables.

Every program gets one thread. A picture's file ends with .png, 8 bits and sRGB-encoded, or holds linear light: .pfm,
floats, by weft, and .ppm, 16 bits, by the peers. The commands are run in a folder that holds the exported scenes."""
import array
import datetime
import os
import re
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(HERE)))
BUILD = os.path.abspath(os.environ.get("WEFT_BUILD", os.path.join(ROOT, "build")))
WEFT = os.path.join(BUILD, "weft")
NFF = os.path.join(os.path.dirname(HERE), "scenes")
SCENES = ["balls", "gears", "mount", "rings", "teapot", "tetra", "tree", "showcase"]
PEERS = ["povray", "tachyon"]
PROGRAMS = ["weft"] + PEERS

# --- the scenes ----------------------------------------------------------------------------------------------


def scene_path(name, nff):
    """Where the scene is; nff is the folder of those that are not weft's own."""
    folder, ending = (os.path.join(ROOT, "scenes"), ".json") if name == "showcase" else (nff, ".nff")
    return os.path.abspath(os.path.join(folder, name + ending))


def scene_size(name, width):
    return (width, width * 9 // 16) if name == "showcase" else (width, width)


def export(path, size, folder):
    """Writes the scene in the peers' languages: scene.pov and scene.dat, and Tachyon's textures."""
    for language, name in (("pov", "scene.pov"), ("tachyon", "scene.dat")):
        run([os.path.join(BUILD, "bench", "export"), language, path, "%dx%d" % size, name], folder)


# --- the commands --------------------------------------------------------------------------------------------
# Each takes the scene's path (which only weft needs), the size of the picture, its file, and options of the sampling.


def weft_command(path, size, picture, sampling):
    return [WEFT, "render", path, "--quiet", "--workers", "1", "--threads", "1", "--size", "%dx%d" % size, "-o",
            picture] + sampling


def povray_command(_, size, picture, sampling):
    output = ["+FN8", "File_Gamma=srgb"] if picture.endswith(".png") else ["+FP16", "File_Gamma=1.0"]
    return ["povray", "+Iscene.pov", "+WT1", "-D", "-GA", "+W%d" % size[0], "+H%d" % size[1], "+O" + picture] + \
        output + sampling


def tachyon_command(_, size, picture, sampling):
    return ["tachyon", "scene.dat", "-res", str(size[0]), str(size[1]), "-numthreads", "1", "-shade_phong", "-format",
            "PNG" if picture.endswith(".png") else "PPM48", "-o", picture] + sampling


COMMANDS = {"weft": weft_command, "povray": povray_command, "tachyon": tachyon_command}


def povray_uniform(side):
    """+AM1 takes one sample and, as every difference is at least 0.0, side x side more; side 0: that one alone.
    More than 9 x 9 POV-Ray does not take; it does not say so either."""
    return ["+A0.0", "+AM1", "+R%d" % side, "-J"] if side else ["-A"]


def tachyon_uniform(samples):
    """-aasamples counts the samples beyond the first."""
    return ["-aasamples", str(samples - 1)]


def run(argv, folder):
    """Runs to the end; the CPU seconds of the process and its children. Its talk is shown only if it fails."""
    with tempfile.TemporaryFile() as talk:
        process = subprocess.Popen(argv, cwd=folder, stdin=subprocess.DEVNULL, stdout=talk, stderr=talk)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode != 0:
            talk.seek(0)
            sys.exit("%s\n%s: exit status %d" % (talk.read().decode(errors="replace"), " ".join(argv),
                                                process.returncode))
    return usage.ru_utime + usage.ru_stime


# --- the pictures --------------------------------------------------------------------------------------------


def read_ppm(path):
    """Width, height and the channels in linear light, 0..65535, rows from the top."""
    with open(path, "rb") as file:
        data = file.read()
    fields, at = [], 0
    while len(fields) < 4:
        end = data.index(b"\n", at)
        fields += data[at:end].split(b"#")[0].split()
        at = end + 1
    if fields[0] != b"P6" or fields[3] != b"65535":
        sys.exit("%s: expected a PPM of 16 bits, found %r" % (path, fields))
    values = array.array("H", data[at:])
    if sys.byteorder == "little":
        values.byteswap()
    return int(fields[1]), int(fields[2]), values


def to_pfm(ppm, pfm):
    """The same picture as floats, which `weft compare` takes for linear light; a PFM's rows go upwards."""
    width, height, values = read_ppm(ppm)
    floats = array.array("f", (value / 65535 for value in values))
    with open(pfm, "wb") as file:
        file.write(b"PF\n%d %d\n%.1f\n" % (width, height, -1 if sys.byteorder == "little" else 1))
        for y in reversed(range(height)):
            file.write(floats[3 * width * y:3 * width * (y + 1)].tobytes())


def render(program, path, size, sampling, pfm, folder):
    """Renders in linear light into the file pfm of the folder; the CPU seconds, without the conversion."""
    picture = pfm if program == "weft" else program + ".ppm"
    seconds = run(COMMANDS[program](path, size, picture, sampling), folder)
    if program != "weft":
        to_pfm(os.path.join(folder, picture), os.path.join(folder, pfm))
    return seconds


def compare(first, second, folder):
    """RMSE and FLIP between two pictures."""
    talk = subprocess.run([WEFT, "compare", first, second], cwd=folder, stdout=subprocess.PIPE, text=True,
                          check=True).stdout
    return tuple(float(re.search("^%s: (.*)$" % name, talk, re.MULTILINE).group(1)) for name in ("RMSE", "FLIP"))


# --- tables --------------------------------------------------------------------------------------------------


def first_line(argv):
    talk = subprocess.run(argv, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
                          text=True, check=False, cwd=ROOT).stdout
    return next((line.strip() for line in talk.splitlines() if line.strip()), "?")


def package_version(name):
    return first_line(["dpkg-query", "-W", "-f", "${Version}", name])


def processor():
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        for line in file:
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return os.uname().machine


def print_head():
    commit = first_line(["git", "describe", "--always", "--dirty"])
    print("%s, commit %s" % (datetime.date.today().isoformat(), commit))
    print("%s, %d cores, load %.1f; %s" % (processor(), os.cpu_count(), os.getloadavg()[0],
                                          first_line([os.environ.get("CC", "gcc"), "--version"])))
    print("POV-Ray %s, Tachyon %s" % (package_version("povray"), package_version("tachyon")))


def print_row(cells, widths):
    print("| " + " | ".join(cell.ljust(width) for cell, width in zip(cells, widths)) + " |")


def print_table(head, rows):
    widths = [max(len(row[i]) for row in [head] + rows) for i in range(len(head))]
    print_row(head, widths)
    print("|" + "|".join("-" * (width + 2) for width in widths) + "|")
    for row in rows:
        print_row(row, widths)
    print()
