/* A program of another version of the interface. It also shows that abi.h is C. */
#include <robocomp/abi.h>

int main(void) {
  static const char release[] = "9.9.9";
  struct rc_program program = {0};
  program.version = RC_ABI_VERSION + 1;
  program.release.data = (const uint8_t*)release;
  program.release.size = sizeof release - 1;
  return robocomp_run(&program, 0, 0);
}
