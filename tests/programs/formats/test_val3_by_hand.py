"""A VAL3 project as people write it: loops, absent attributes, other names, data that nothing uses."""

import numpy as np
from builders.export_jobs import cell_of, controlled, job_of, random_program
from builders.scene_builders import arm_model

from cellplan.programs.formats.val3.writer import VAL3

HAND_MADE = {
    "weld/weld.pjx": """<?xml version="1.0" encoding="utf-8" ?>
<Project xmlns="http://www.staubli.com/robotics/VAL3/Project/3" >
  <Parameters version="s7.3.1" stackSize="5000" millimeterUnit="true" />
  <Programs>
    <Program file="start.pgx" />
    <Program file="path.pgx" />
    <Program file="stop.pgx" />
  </Programs>
  <Database>
    <Data file="weld.dtx" />
  </Database>
  <Libraries>
  </Libraries>
</Project>
""",
    "weld/weld.dtx": """<?xml version="1.0" encoding="utf-8" ?>
<Database xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xmlns="http://www.staubli.com/robotics/VAL3/Data/2">
  <Datas>
    <Data name="jPoint" access="public" xsi:type="array" type="jointRx" size="5">
      <Value key="0" j3="90" j5="90" />
      <Value j1="-1.5" key="1" j3="85" />
      <Value key="2" />
      <Value key="3" j6="0.001" />
      <Value key="4" j2="7" />
    </Data>
    <Data name="mNomSpeed" access="public" xsi:type="array" type="mdesc" size="1" />
    <Data name="mFast" access="public" xsi:type="array" type="mdesc" size="1">
      <Value key="0" vel="75.5" blend="joint" leave="5" reach="5" />
    </Data>
    <Data name="nTraj" access="public" xsi:type="array" type="num" size="1"/>
    <Data name="tCad" access="public" xsi:type="array" type="tool" size="1">
      <Value key="0" z="120.5" fatherId="flange[0]" ioLink="valve1" />
    </Data>
  </Datas>
</Database>
""",
    "weld/start.pgx": """<?xml version="1.0" encoding="utf-8"?>
<Programs xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xmlns="http://www.staubli.com/robotics/VAL3/Program/2">
  <Program name="start" access="public">
    <Code><![CDATA[
begin
  // main
  call path()
  waitEndMove()
end
      ]]></Code>
  </Program>
</Programs>
""",
    "weld/path.pgx": """<?xml version="1.0" encoding="utf-8"?>
<Programs xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xmlns="http://www.staubli.com/robotics/VAL3/Program/2">
  <Program name="path" access="private">
    <Parameters xmlns="http://www.staubli.com/robotics/VAL3/Param/1">
    </Parameters>
    <Locals>
      <Local name="l_nIndex" type="num" xsi:type="array" size="1" />
    </Locals>
    <Code><![CDATA[
begin
  movej(jPoint[0], tCad[0], mNomSpeed)
  for l_nIndex = 1 to 3
    movej(jPoint[l_nIndex], tCad, mFast)
  endFor
  for nTraj = 4 to 4 step 2
    movej(jPoint[nTraj], tCad, mNomSpeed)
  endFor
end
      ]]></Code>
  </Program>
</Programs>
""",
    "weld/stop.pgx": """<?xml version="1.0" encoding="utf-8"?>
<Programs xmlns="http://www.staubli.com/robotics/VAL3/Program/2">
  <Program name="stop" access="private">
    <Code><![CDATA[
      begin
        resetMotion()
      end
    ]]></Code>
  </Program>
</Programs>
""",
}


def test_a_project_written_by_hand_with_loops_is_read() -> None:
    cell = cell_of(controlled("weld", arm_model()), kind="staubli")
    frame = job_of(cell, random_program(cell)).frame

    (read,) = VAL3.read(frame, HAND_MADE)

    expected = [[0, 0, 90, 0, 90, 0], [-1.5, 0, 85, 0, 0, 0], [0] * 6, [0, 0, 0, 0, 0, 0.001], [0, 7, 0, 0, 0, 0]]
    assert np.allclose(np.rad2deg(read.robots["weld"].q), expected, atol=1e-12)
    assert read.robots["weld"].times is None
