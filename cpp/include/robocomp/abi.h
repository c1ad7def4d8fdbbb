/* The interface in C between the headers of robocomp and librobocomp_cpp.so. Programs use the
 * headers above it. Every change raises RC_ABI_VERSION, which both sides compare at start. */
#ifndef ROBOCOMP_ABI_H
#define ROBOCOMP_ABI_H

#include <stddef.h>
#include <stdint.h>

#define RC_ABI_VERSION 6
#define RC_RELEASE "0.1.0"

/* Bytes of the caller, or of the callee until its next call on the same thread. */
struct rc_bytes {
  const uint8_t* data;
  size_t size;
};

/* Result of a call in either direction. `bytes` is a value in CDR, or a text. */
struct rc_answer {
  int32_t status;
  int64_t number;
  struct rc_bytes bytes;
};

enum rc_status {
  RC_DONE = 0,
  RC_EXCEPTION = 1, /* `number` is the hash of its name */
  RC_NO_SERVER = 10,
  RC_TIMEOUT = 11,
  RC_SERVER_DIED = 12,
  RC_QUEUE_FULL = 13,
  RC_REFUSED = 14,
  RC_UNAVAILABLE = 15,
  RC_STOPPING = 16,
  RC_INVALID_ARGUMENT = 17,
  RC_MALFORMED_REPLY = 18,
  RC_MIDDLEWARE = 19,
  RC_INVALID_SAMPLE = 20,
  RC_NOT_SENT = 21,
  RC_STALE = 22, /* `number` is the age in nanoseconds */
  RC_NO_VALUE = 23,
  RC_TOO_MANY_STARTED = 24,
  RC_NOT_ENDED = 25, /* a started call has no result that can be taken */
  RC_NOT_ADVANCED = 26, /* the time of the network */
  RC_WRONG_THREAD = 30,
  RC_INTERNAL = 31,
  RC_NO_MEMBER = 32,
  /* Outcomes of a function of the worker. */
  RC_FAILED = 40,
  RC_EMERGENCY = 41,
  RC_FATAL = 42,
  RC_NOT_WRITTEN = 43
};

enum rc_function {
  RC_INITIALIZE,
  RC_COMPUTE,
  RC_SET_PARAMETERS,
  RC_PARAMETERS_CHANGED,
  RC_ENTER_EMERGENCY,
  RC_RESTORE,
  RC_FINALIZE,
  RC_TRANSITION,
  RC_ERROR,
  RC_ENTRY,
  RC_EXIT,
  RC_DURING,
  RC_GUARD,
  RC_ACTION,
  RC_HANDLE,
  RC_COLLECTED, /* `body` has an age and a sequence of octets for each topic */
  RC_ENDED,
  RC_ANSWER, /* of a fake server */
  RC_OPENED, /* a member of a slot array, in a test */
  RC_WAIT,   /* in a window, until the descriptor `first` is readable, at most `second` nanoseconds */
  RC_END
};

enum rc_get_what {
  RC_NAME,
  RC_NETWORK,
  RC_STATE,
  RC_NOW,
  RC_PERIOD,
  RC_IS_STOPPING,
  RC_SEED,
  RC_PEERS,
  RC_CALL_TIMEOUT,
  RC_IS_IN,
  RC_HAS_ENDED,
  RC_FRESHNESS, /* an age, or -1 */
  RC_LISTED,    /* members of a slot array as a sequence of texts, or -1 */
  /* Of the source of the network's time. */
  RC_TIME_IS_ACTIVE,
  RC_TIME_TICK,
  RC_TIME_MISSING,  /* a sequence of texts */
  RC_TIME_FOLLOWERS /* likewise */
};

/* An age in a number: nanoseconds times 8, plus twice the label, plus 1 if it is fresh. The labels
 * are 0 computed, 1 partly cached, 2 cached. */

enum rc_set_what {
  RC_SET_PERIOD,
  RC_SET_CALL_TIMEOUT,
  RC_STOP,
  RC_FIRE,
  RC_OPEN, /* a member of a slot array; answers the number of its slot */
  /* Of the source of the network's time. The first two answer the number of the tick. */
  RC_TIME_ADVANCE,
  RC_TIME_SET,
  RC_TIME_WAIT,    /* for all followers, so many nanoseconds; -1: for nobody */
  RC_TIME_ORDER,   /* 1: in turn */
  RC_TIME_PACE,    /* 1: by the period */
  RC_TIME_RELEASE, /* a follower; answers 1 if there is one */
  /* Requests a change of a parameter: `text` is its path and, in the next lines, a text; `number` is an
   * rc_value_kind. */
  RC_SET_PARAMETER
};

/* `value` is 0 or 1, an integer, the bits of a double, nothing, or nanoseconds. */
enum rc_value_kind { RC_BOOL, RC_INT, RC_FLOAT, RC_TEXT, RC_DURATION };

/* A call of a function of the worker. `first` and `second` are slot and operation, or the number of
 * a state, a guard or an action. `name` is a transition, or a member of a slot array, whose number is
 * `member`. `held` is a sample in place, whose `body` lives until robocomp_drop, or a started call that
 * has ended with `status` and `number`; or 0. */
struct rc_call {
  int32_t function;
  size_t first;
  size_t second;
  struct rc_bytes name;
  size_t member;
  struct rc_bytes body;
  uint64_t held;
  int32_t status;
  int64_t number;
};

/* Runs a function of the worker; throws nothing. */
typedef struct rc_answer (*rc_call_worker)(void* object, const struct rc_call* call);

/* A component. Every version begins with the first two members. */
struct rc_program {
  uint32_t version;
  struct rc_bytes release;
  struct rc_bytes description;
  struct rc_bytes folder;
  rc_call_worker call;
  void* object;
};

#ifdef __cplusplus
extern "C" {
#endif

int32_t robocomp_run(const struct rc_program* program, size_t count, const char* const* arguments);
struct rc_answer robocomp_call(size_t slot, size_t operation, struct rc_bytes body);
struct rc_answer robocomp_publish(size_t slot, size_t operation, struct rc_bytes body);
/* The newest sample of a topic; the number of the answer is its age. */
struct rc_answer robocomp_newest(size_t slot, size_t operation);
/* Sets the reply that answers a query without a handler. */
struct rc_answer robocomp_set_latest(size_t slot, size_t operation, struct rc_bytes body);
struct rc_answer robocomp_get(uint32_t what, size_t number);
struct rc_answer robocomp_set(uint32_t what, size_t number, int64_t value, struct rc_bytes text);
void robocomp_log(uint32_t level, struct rc_bytes text);

/* Starts a query. The number of the answer is that of the call. */
struct rc_answer robocomp_start(size_t slot, size_t operation, struct rc_bytes body);
/* Takes the result of a started call, once. */
struct rc_answer robocomp_take(size_t slot, uint64_t call);
/* Begins a sample in place. The answer has its number, and memory that may be written until the number
 * is sent or dropped. */
struct rc_answer robocomp_loan(size_t slot, size_t operation);
struct rc_answer robocomp_send(uint64_t loan);
/* Ends a view, a loan or a started call, from any thread. */
void robocomp_drop(uint64_t number);

/* What a test does with its bench. A fake peer is named by its slot and, in `text`, its member. */
enum rc_test_what {
  RC_TEST_CLOSE,
  RC_TEST_RUN,        /* for `value` nanoseconds */
  RC_TEST_TRANSITION, /* `text`; answers the state afterwards */
  RC_TEST_END_CALLS,
  RC_TEST_ADVANCE,
  RC_TEST_SET_TIME,
  RC_TEST_SET_STATE,
  RC_TEST_LIST_MEMBERS, /* the name of an array and those of its members, in lines */
  RC_TEST_SERVER,
  RC_TEST_ANSWER, /* by RC_ANSWER, the operation `value` */
  RC_TEST_CALLS,  /* takes them: a sequence of operation and body */
  RC_TEST_FAIL,   /* an rc_test_fault; plus 16 for the next call only */
  RC_TEST_RECOVER,
  RC_TEST_SUBSCRIBER,
  RC_TEST_SAMPLES,
  RC_TEST_FAIL_PUBLISHING, /* the member and the reason, in lines */
  RC_TEST_SUBSCRIBERS,
  RC_TEST_ANSWER_DEFAULTS,
  RC_TEST_PARAMETERS /* takes requested changes of parameters: a sequence of path and value in TOML */
};
enum rc_test_fault { RC_FAULT_NO_SERVER, RC_FAULT_TIMEOUT, RC_FAULT_SERVER_DIED, RC_FAULT_QUEUE_FULL };

/* Opens the bench of this thread. `program` answers for the fakes. The answer has the parameters of the
 * configuration. */
struct rc_answer robocomp_test_open(const struct rc_program* program);
struct rc_answer robocomp_test_start(rc_call_worker call, void* object, struct rc_bytes parameters);
struct rc_answer robocomp_test(uint32_t what, size_t slot, int64_t value, struct rc_bytes text);

#ifdef __cplusplus
}
#endif

#endif
