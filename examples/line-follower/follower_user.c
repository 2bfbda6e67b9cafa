/* The robot's library for the line follower: what the chart's conditions and actions mean on this robot.
   Written once; the chart may change without touching it. Here the "robot" is two sensor variables and two motor variables. */
#include "follower_user.h"

static bool left_sensor_black;
static bool right_sensor_black;
static int left_motor;
static int right_motor;

bool left_ir_black(void)  { return left_sensor_black; }
bool left_ir_white(void)  { return !left_sensor_black; }
bool right_ir_black(void) { return right_sensor_black; }
bool right_ir_white(void) { return !right_sensor_black; }

void left_fw(void)    { left_motor = 1; }
void left_stop(void)  { left_motor = 0; }
void right_fw(void)   { right_motor = 1; }
void right_stop(void) { right_motor = 0; }
