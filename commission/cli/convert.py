"""The command `convert`: reflectors, routes, floor plans and recordings from one format into another."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, UseAppendAction, arg


@dataclass(frozen=True, kw_only=True)
class Convert:
    """Convert reflectors, routes, floor plans and recordings from one format into another, told apart by their endings.

    Reflectors: .csv, .tsv, .imk. Routes: VDMA LIF (.lif, .json), VDA 5050 orders (.json, read only). Floor maps: .yaml.
    Floor plans (read only): .dxf, .stl, .obj, .glb, .ply; they become a map (.yaml). A project folder gives and takes
    all of these. A recording (CSV folder, ROS bag .mcap, .db3
    or .bag, capture .pcap or .pcapng, CARMEN log) becomes a CSV folder, a bag of ROS 2 (.mcap, which Foxglove opens, or
    .db3) or a bag of ROS 1 (.bag).
    """

    source: Annotated[Positional[Path], arg(metavar="IN")]
    """File or folder to read."""
    target: Annotated[Positional[Path], arg(metavar="OUT")]
    """File or folder to write; what is there already stays unless --force is given."""
    vehicle_type: Annotated[str | None, arg(metavar="NAME")] = None
    """LIF: vehicle type whose edges are read. None: the one with the most edges."""
    layout: Annotated[str | None, arg(metavar="NAME")] = None
    """LIF: identifier of the layout to read. None: all of them."""
    unit: Annotated[str | None, arg(metavar="mm|cm|m|in|ft|yd|us-ft")] = None
    """Drawing or model: unit in which it was made. None: what a drawing states; metres for a model."""
    layer: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")] = ()
    """Drawing: a layer that holds walls; repeat it for several. None: every visible layer."""
    height: Annotated[UseAppendAction[tuple[float, ...]], arg(metavar="M")] = ()
    """Model: height at which it is cut [m]; repeat it for several. None: 0.2 m, a safety scanner's."""
    up: Annotated[str | None, arg(metavar="y|z")] = None
    """Model: axis that points up. None: y for .glb, z for the others."""
    resolution: float = 0.05
    """Drawing or model: edge of a cell of the map [m]."""
    force: bool = False
    """Whether a file or recording that is there is replaced. A project that is there then takes what IN holds in place
    of its own, and keeps the rest."""

    channel: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="KIND=TOPIC")] = ()
    """ROS bag with several candidates: the topic of scan (or scan.NAME, for each of several scanners), odometry or
    reference; the topic none: of no topic. Repeat it for several."""
    wheels: Annotated[str | None, arg(metavar="LEFT,RIGHT,RADIUS,SEPARATION[,TICKS]")] = None
    """ROS bag whose odometry is a JointState: names of the two driven wheels, their radius and distance [m], and counts
    for one turn where they are no radians."""

    def run(self) -> None:
        """Convert, and tell what was made up, doubted or lost."""
        from commission.io.interchange import ConvertOptions, convert_file
        from commission.io.recordings.channels import ChannelOptions

        options = ConvertOptions(
            vehicle_type=self.vehicle_type,
            layout=self.layout,
            unit=self.unit,
            layers=self.layer,
            heights=self.height or (0.2,),
            up=self.up,
            resolution=self.resolution,
            recording=ChannelOptions.parse(self.channel, self.wheels),
        )
        for line in convert_file(self.source, self.target, options, force=self.force):
            sys.stdout.write(f"Note         {line}\n")
        sys.stdout.write(f"Written to   {self.target}\n")
