MODULE mod_nrdf_plate
  ! Tool paths for a plate, written by nrdf.
  ! Frame: cell. Positions are those of the tool centre point. Lengths in mm, speeds in mm/s.
  ! In the frame, up for the object is 0.0000 0.0000 1.0000, ahead is 0.0000 1.0000 0.0000.
  ! Orientation: quaternion q1 q2 q3 q4 = w x y z; tool z points into the part, tool x along the
  ! travel.
  ! Contact force is not carried: it needs the option Force Control, and stands in comments.
  ! Spindle speed is not either: switch it where a path begins. Dwell is.
  ! Must exist in the controller: wobjdata cell; tooldata disc_125, camera. The configuration is
  ! left to the controller (ConfL off).
  ! The way to the first waypoint of each path is not checked for collisions, and no robot model
  ! was used: simulate the program before it runs.
  ! Path 1: top, sand with disc 125, radius 62.500 mm, spindle 3819.7 rpm, segments: 3,
  ! waypoints: 8, tool 1.
  ! Path 2: top, inspect with camera, radius 10.000 mm, segments: 1, waypoints: 2, tool 2.
  LOCAL CONST speeddata nrdf_v1:=[100.0000,500,5000,1000];
  LOCAL CONST speeddata nrdf_v2:=[33.3000,500,5000,1000];
  LOCAL CONST speeddata nrdf_v3:=[250.0000,500,5000,1000];
  LOCAL CONST zonedata nrdf_zone:=[FALSE,1.000,1.000,1.000,1,1.000,1];

  PROC nrdf_plate()
    ConfJ\Off;
    ConfL\Off;
    p1_top;
    p2_top;
    ConfL\On;
    ConfJ\On;
  ENDPROC

  LOCAL PROC p1_top()
    ! Path 1: top, sand with disc 125
    ! Segment 1: approach, line 0, 100.000 mm/s, no contact force
    MoveJ [[100.30000,61.40800,450.00000],[0.047483240,0.983335010,0.174547930,-0.018182890],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],nrdf_v1,fine,disc_125\WObj:=cell;
    MoveL [[100.30000,61.40800,400.00000],[0.047483240,0.983335010,0.174547930,-0.018182890],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],nrdf_v1,fine,disc_125\WObj:=cell;
    ! Segment 2: process, line 0, 33.300 mm/s, force 15.000 N
    MoveL [[120.20000,68.57200,399.59200],[0.088692280,0.978967400,0.177606160,-0.047037770],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],nrdf_v2,nrdf_zone,disc_125\WObj:=cell;
    MoveL [[141.50000,76.24000,398.27800],[0.120575830,0.973517450,0.181422260,-0.069362870],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],nrdf_v2,nrdf_zone,disc_125\WObj:=cell;
    MoveL [[160.10000,82.93600,396.38800],[0.158945650,0.964482560,0.187748560,-0.096229710],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],nrdf_v2,fine,disc_125\WObj:=cell;
    WaitTime 0.500;
    ! Segment 3: retract, line 0, 250.000 mm/s, no contact force
    MoveL [[160.10000,82.93600,446.38800],[0.158945650,0.964482560,0.187748560,-0.096229710],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],nrdf_v3,fine,disc_125\WObj:=cell;
  ENDPROC

  LOCAL PROC p2_top()
    ! Path 2: top, inspect with camera
    ! Segment 1: process, line 0, 100.000 mm/s, no contact force
    MoveJ [[100.30000,61.40800,450.00000],[0.047483240,0.983335010,0.174547930,-0.018182890],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],nrdf_v1,fine,camera\WObj:=cell;
    MoveL [[120.20000,68.57200,449.59200],[0.088692280,0.978967400,0.177606160,-0.047037770],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],nrdf_v1,fine,camera\WObj:=cell;
  ENDPROC
ENDMODULE
