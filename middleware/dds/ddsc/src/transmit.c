/* ddsi_transmit.c of the library as it is, with three of its calls going through hooks: samples carry parameters in their
 * inline QoS, which the library does not offer, and the first transmission of a large sample is paced.
 *
 * build.rs compiles this file in the place of ddsi_transmit.c, and fails if the library calls these functions more or less
 * often than it did when the hooks were written: a call that goes past a hook would be silent.
 */

#include <stdbool.h>
#include <string.h>

#include "dds/ddsi/ddsi_endpoint.h"
#include "dds/ddsi/ddsi_serdata.h"
#include "dds/ddsrt/time.h"
#include "ddsi__endpoint_match.h"
#include "ddsi__protocol.h"
#include "ddsi__xmsg.h"

/* In shim.c: writes the parameters of a sample; whether it has any. */
void rc_inline_qos (struct ddsi_xmsg *m, const struct ddsi_serdata *d);
int rc_has_inline_qos (const struct ddsi_serdata *d);

/* ---- Pacing ---- */

/* Fast DDS takes the system's default for its socket, 212 kB on Linux: three packets of ours. What arrives while it has no
 * processor is lost, to a best-effort reader for good. At the rate for these, the socket holds what is sent in 5 ms; of images of
 * 1 MiB at 30 Hz, 150 of 150 arrived on a loaded machine, at 100 MB/s 136 and 143. Reliable readers ask for what they have lost, but
 * only after some ten milliseconds: to them a writer sends fast until it has to repeat something, and for a while after that at the
 * careful rate. A thread that has more to send
 * gets a higher rate, since the thread sleeps: a quarter above what it has sent in the time since its last sample began. The
 * readers of Cyclone DDS, to whom the library belongs, ask for a larger socket and need no pacing. */
enum { BURST = 64 * 1024, CYCLONE = 0x0110 };
/* Bytes in a millisecond. */
enum { BEST_EFFORT = 40 * 1000, CAREFUL = 100 * 1000, RELIABLE = 400 * 1000 };
/* How long a writer is careful, in nanoseconds. */
#define RC_CAREFUL_TIME DDS_MSECS (200)

/* Of this thread: the bytes of fragments that were made and not handed on yet, and whether they are paced. Fragments are made
 * with the writer locked, where nobody may sleep, and handed on without. */
static _Thread_local uint32_t rc_made;
static _Thread_local bool rc_is_paced;
/* When its last sample began, the size of that sample, and the present rate in bytes a millisecond. */
static _Thread_local int64_t rc_begun;
static _Thread_local uint32_t rc_size;
static _Thread_local int64_t rc_rate = BEST_EFFORT;
/* The time at which the bucket is full again. */
static _Thread_local int64_t rc_full_at;

/* What this thread knows of the writers whose large samples it has sent last. */
enum { RC_WRITERS = 8 };
static _Thread_local struct rc_repeating {
  ddsi_guid_t writer;
  uint64_t bytes;         /* that the writer had repeated at its last sample */
  int64_t careful_until;
} rc_repeating[RC_WRITERS];
static _Thread_local uint32_t rc_next_writer;

/* The rate for reliable readers of a writer, which is locked. */
static int64_t rc_reliable_rate (const struct ddsi_writer *wr)
{
  const int64_t now = ddsrt_time_monotonic ().v;
  for (uint32_t i = 0; i < RC_WRITERS; i++) {
    struct rc_repeating *r = &rc_repeating[i];
    if (memcmp (&r->writer, &wr->e.guid, sizeof (r->writer)) != 0)
      continue;
    if (wr->rexmit_bytes != r->bytes) {
      r->bytes = wr->rexmit_bytes;
      r->careful_until = now + RC_CAREFUL_TIME;
    }
    return now < r->careful_until ? CAREFUL : RELIABLE;
  }
  rc_repeating[rc_next_writer++ % RC_WRITERS] = (struct rc_repeating) { .writer = wr->e.guid, .bytes = wr->rexmit_bytes };
  return RELIABLE;
}

static void rc_begin (const struct ddsi_serdata *d, int64_t slowest)
{
  const int64_t now = ddsrt_time_monotonic ().v, elapsed = now - rc_begun;
  const int64_t demand = elapsed > 0 ? (int64_t) rc_size * 1000000 / elapsed : 0;
  rc_rate = demand / 4 * 5 > slowest ? demand / 4 * 5 : slowest;
  rc_begun = now;
  rc_size = ddsi_serdata_size (d);
}

/* The slowest rate for readers with a small socket; 0 if there are none. The first two bytes of a GUID name the vendor (RTPS
 * 2.5, 9.3.1.5). */
static int64_t rc_slowest (const struct ddsi_writer *wr)
{
  int64_t slowest = 0;
  ddsrt_avl_iter_t it;
  for (const struct ddsi_wr_prd_match *m = ddsrt_avl_iter_first (&ddsi_wr_readers_treedef, &wr->readers, &it); m != NULL; m = ddsrt_avl_iter_next (&it)) {
    if (m->prd_guid.prefix.u[0] >> 16 == CYCLONE)
      continue;
    if (!m->is_reliable)
      return BEST_EFFORT;
    slowest = RELIABLE;
  }
  return slowest == RELIABLE ? rc_reliable_rate (wr) : slowest;
}

static void rc_note (struct ddsi_xmsg *m, const struct ddsi_writer *wr, const struct ddsi_serdata *d, size_t offset, size_t size)
{
  if (size == ddsi_serdata_size (d) || ddsi_xmsg_kind (m) != DDSI_XMSG_KIND_DATA)
    return;
  if (offset == 0) {
    rc_made = 0;
    const int64_t slowest = rc_slowest (wr);
    rc_is_paced = slowest != 0;
    if (rc_is_paced)
      rc_begin (d, slowest);
  }
  if (rc_is_paced)
    rc_made += (uint32_t) size;
}

static void rc_pace (struct ddsi_xpack *xp)
{
  if (rc_made == 0)
    return;
  const int64_t cost = (int64_t) rc_made * 1000000 / rc_rate, burst = (int64_t) BURST * 1000000 / rc_rate;
  rc_made = 0;
  const int64_t now = ddsrt_time_monotonic ().v;
  if (rc_full_at < now)
    rc_full_at = now;
  rc_full_at += cost;
  if (rc_full_at - now > burst) {
    /* What was packed before goes out, and this message waits. */
    ddsi_xpack_send (xp, true);
    dds_sleepfor (rc_full_at - now - burst);
  }
}

/* ---- Parameters ---- */

/* Fragments after the first one: the library adds no parameters to these, and the first one may be lost and come last. */
static void rc_later (struct ddsi_xmsg *m, struct ddsi_xmsg_marker at, const struct ddsi_serdata *d, size_t offset)
{
  if (offset > 0 && rc_has_inline_qos (d)) {
    rc_inline_qos (m, d);
    ddsi_xmsg_addpar_sentinel (m);
    ((ddsi_rtps_submessage_header_t *) ddsi_xmsg_submsg_from_marker (m, at))->flags |= DDSI_DATAFRAG_FLAG_INLINE_QOS;
  }
}

/* `serdata` and `sm_marker` are variables of the callers. */
#define ddsi_xmsg_addpar_sentinel_ifparam(m) (rc_inline_qos ((m), serdata), (ddsi_xmsg_addpar_sentinel_ifparam) (m))
#define ddsi_xmsg_serdata(m, d, off, len, wr) \
  (rc_note ((m), (wr), (d), (off), (len)), rc_later ((m), sm_marker, (d), (off)), (ddsi_xmsg_serdata) ((m), (d), (off), (len), (wr)))
#define ddsi_xpack_addmsg(xp, m, flags) (rc_pace (xp), (ddsi_xpack_addmsg) ((xp), (m), (flags)))
#include "ddsi_transmit.c"
