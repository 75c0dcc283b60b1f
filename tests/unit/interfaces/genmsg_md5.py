"""Print genmsg's md5 sums of all definitions in a folder; run by Debian's Python."""

import json
import pathlib
import sys

sys.path.insert(0, "/usr/lib/python3/dist-packages")

from genmsg import MsgContext, gentools, msg_loader


def main(root: pathlib.Path) -> None:
    search = {folder.name: [str(folder / "msg")] for folder in root.iterdir()}
    sums = {}
    for path in sorted(root.glob("*/*/*")):
        package, kind = path.parent.parent.name, path.suffix[1:]
        context = MsgContext.create_default()
        load = {
            "msg": msg_loader.load_msg_from_file,
            "srv": msg_loader.load_srv_from_file,
        }[kind]
        spec = load(context, str(path), f"{package}/{path.stem}")
        msg_loader.load_depends(context, spec, search)
        sums[f"{package}/{kind}/{path.stem}"] = gentools.compute_md5(context, spec)
    print(json.dumps(sums))


main(pathlib.Path(sys.argv[1]))
